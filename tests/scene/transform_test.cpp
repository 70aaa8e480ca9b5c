// Transforms against matrices worked out by hand.
#include "runtime/scene/transform.h"

#include <cmath>

#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

// The transform of an orthographic sensor, which takes any.
Transform parse(const std::string& steps) {
  return SceneFolder()
      .load("<sensor type=\"orthographic\"><transform name=\"to_world\">" + steps + "</transform></sensor>")
      .sensors[0]
      .to_world;
}

void check_equal(const Transform& got, const std::array<double, 16>& expected) {
  for (std::size_t i = 0; i < 16; ++i) {
    INFO("entry " << i);
    CHECK(got.m[i] == Approx(expected[i]).margin(1e-12));
  }
}

void check_error(const std::string& steps, const std::vector<std::string>& words) {
  SceneFolder().check_error(
      "<sensor type=\"orthographic\"><transform name=\"to_world\">\n" + steps + "</transform></sensor>", 3, words);
}

}  // namespace

TEST_CASE("translate moves by x, y, z, or by a value") {
  check_equal(parse("<translate x=\"1\" z=\"3\"/>"), {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 3, 0, 0, 0, 1});
  check_equal(parse("<translate value=\"1, 2, 3\"/>"), {1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1});
}

TEST_CASE("scale multiplies: one number counts for all axes, a missing axis for 1") {
  check_equal(parse("<scale value=\"2\"/>"), {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1});
  check_equal(parse("<scale value=\"1 2 3\"/>"), {1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1});
  check_equal(parse("<scale y=\"-2\"/>"), {1, 0, 0, 0, 0, -2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
}

TEST_CASE("rotate turns counterclockwise as seen against its axis, in degrees") {
  check_equal(parse("<rotate z=\"1\" angle=\"90\"/>"), {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  check_equal(parse("<rotate value=\"1, 0, 0\" angle=\"90\"/>"), {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1});
  check_equal(parse("<rotate y=\"1\" angle=\"90\"/>"), {0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1});
}

TEST_CASE("a turn by 120 degrees about the diagonal permutes the axes") {
  const std::string k = "0.57735026918962576";
  const Transform t = parse("<rotate x=\"" + k + "\" y=\"" + k + "\" z=\"" + k + "\" angle=\"120\"/>");
  check_equal(t, {0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1});
}

TEST_CASE("an axis that is no unit vector shears as in Mitsuba 3.9.1, with a warning") {
  const Scene scene = SceneFolder().load(
      "<sensor type=\"orthographic\"><transform name=\"to_world\">\n<rotate y=\"2\" "
      "angle=\"30\"/></transform></sensor>");
  const double c = std::cos(M_PI / 6);
  check_equal(scene.sensors[0].to_world, {c, 0, 1, 0, 0, 4 - 3 * c, 0, 0, -1, 0, c, 0, 0, 0, 0, 1});
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("scene.xml:3:1: ") && Catch::Contains("length 2"));
}

TEST_CASE("a matrix is read row by row, 3x3 or 4x4") {
  check_equal(parse("<matrix value=\"1 2 3 4 0 5 6 7 0 0 8 9 0 0 0 1\"/>"),
              {1, 2, 3, 4, 0, 5, 6, 7, 0, 0, 8, 9, 0, 0, 0, 1});
  check_equal(parse("<matrix value=\"1 2 3 0 5 6 0 0 8\"/>"), {1, 2, 3, 0, 0, 5, 6, 0, 0, 0, 8, 0, 0, 0, 0, 1});
}

TEST_CASE("lookat puts +z towards the target, +x to the left, +y up") {
  // From (0, 0, 5) to the origin: forward (0, 0, -1), up (0, 1, 0), left = up x forward = (-1, 0, 0).
  check_equal(parse("<lookat origin=\"0, 0, 5\" target=\"0, 0, 0\" up=\"0, 1, 0\"/>"),
              {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 5, 0, 0, 0, 1});
  // Up need not be perpendicular nor unit.
  check_equal(parse("<lookat origin=\"0 0 5\" target=\"0 0 0\" up=\"0 3 2\"/>"),
              {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 5, 0, 0, 0, 1});
}

TEST_CASE("lookat without up chooses what Mitsuba 3.9.1 chooses") {
  const Transform t = parse("<lookat origin=\"1,2,3\" target=\"0,0,0\"/>");
  const double expected[9] = {-0.0792865, 0.960357,  -0.267261, 0.841427, -0.0792865,
                              -0.534522,  -0.534522, -0.267261, -0.801784};
  for (std::size_t i = 0; i < 9; ++i) CHECK(t.m[i / 3 * 4 + i % 3] == Approx(expected[i]).margin(2e-6));
}

TEST_CASE("steps apply in document order") {
  check_equal(parse("<scale value=\"2\"/><translate x=\"1\"/>"), {2, 0, 0, 1, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1});
  check_equal(parse("<translate x=\"1\"/><scale value=\"2\"/>"), {2, 0, 0, 2, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1});
}

TEST_CASE("inverse_transpose keeps normals perpendicular to surfaces") {
  const Transform t{{2, 1, 0, 3, 0.5, 1, -1, 0, 0, 2, 1, 0, 0, 0, 0, 1}};
  const Transform n = inverse_transpose(t);
  for (const Vec3& tangent : {Vec3{1, 0, 0}, {0, 1, 0}, {1, 2, 3}}) {
    for (const Vec3& other : {Vec3{0, 0, 1}, {3, 1, -1}}) {
      const Vec3 normal = cross(tangent, other);
      CHECK(dot(transform_vector(t, tangent), transform_vector(n, normal)) == Approx(0).margin(1e-12));
    }
  }
  CHECK(determinant(t) * determinant(n) == Approx(1));
}

TEST_CASE("one number stands for x, y and z, as in Mitsuba") {
  check_equal(parse("<translate value=\"0.5\"/>"), {1, 0, 0, 0.5, 0, 1, 0, 0.5, 0, 0, 1, 0.5, 0, 0, 0, 1});
  check_equal(parse("<scale value=\"2\"/>"), {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1});
}

TEST_CASE("an up of 0 is any, and the last row of a matrix is left out, as in Mitsuba") {
  CHECK(parse("<lookat origin=\"1,2,3\" target=\"0,0,0\" up=\"0,0,0\"/>").m ==
        parse("<lookat origin=\"1,2,3\" target=\"0,0,0\"/>").m);
  check_equal(parse("<matrix value=\"1 0 0 0 0 1 0 0 0 0 1 5 0 0 .1 2\"/>"),
              {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 5, 0, 0, 0, 1});
  const itn::Scene scene = SceneFolder().load(
      "<shape type=\"cube\"><transform name=\"to_world\"><matrix value=\"1 0 0 0 0 1 0 0 0 0 1 5 0 0 .1 "
      "2\"/></transform>"
      "</shape>");
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("last row"));
}

TEST_CASE("faulty transforms are refused") {
  check_error("<rotate angle=\"3\"/>", {"<rotate>", "axis", "(0, 0, 0)"});
  check_error("<rotate x=\"1\"/>", {"no angle"});
  check_error("<matrix value=\"1 2 3\"/>", {"3 numbers", "16", "9"});
  check_error("<lookat origin=\"1,1,1\" target=\"1,1,1\" up=\"0,1,0\"/>", {"same point"});
  check_error("<lookat origin=\"0,1,0\" target=\"0,0,0\" up=\"0,1,0\"/>", {"parallel"});
  check_error("<lookat origin=\"0,1\" target=\"0,0,0\"/>", {"origin", "2 numbers"});
  check_error("<lookat target=\"0,0,0\"/>", {"no origin"});
  check_error("<scale value=\"1 2\"/>", {"2 numbers"});
  check_error("<scale value=\"1\" x=\"2\"/>", {"both"});
  check_error("<translate w=\"1\"/>", {"\"w\""});
  check_error("<sphere/>", {"<sphere>"});
  check_error("<float name=\"x\" value=\"1\"/>", {"\"translate\""});
  SceneFolder().check_error(
      "<sensor type=\"orthographic\">\n<transform name=\"to_world\"><scale x=\"0\"/></transform></sensor>", 3,
      {"singular"});
}
