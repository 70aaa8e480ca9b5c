// Curves with a thickness as meshes, against values that Mitsuba 3.9.1 gives for rays at them.
#include <cmath>

#include "runtime/scene/mesh/curve_mesh.h"
#include "runtime/scene/transform.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

Vec3 wide(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

// Distance of the line through `from` along `direction` to the mesh's nearest triangle in front; and what is there.
struct Hit {
  double distance = 1e30;
  Vec3 normal{};
  Vec2 uv{};
};
Hit shoot(const Mesh& mesh, const Vec3& from, const Vec3& direction) {
  Hit hit;
  for (const auto& t : mesh.triangle) {
    const Vec3 a = wide(mesh.position[t[0]]), e1 = wide(mesh.position[t[1]]) - a, e2 = wide(mesh.position[t[2]]) - a;
    const Vec3 p = cross(direction, e2), s = from - a, q = cross(s, e1);
    const double det = dot(e1, p);
    if (!(det > 0)) continue;  // fronts alone
    const double u = dot(s, p) / det, v = dot(direction, q) / det, distance = dot(e2, q) / det;
    if (u < 0 || v < 0 || u + v > 1 || distance >= hit.distance) continue;
    hit.distance = distance;
    hit.normal =
        normalize((1 - u - v) * wide(mesh.normal[t[0]]) + u * wide(mesh.normal[t[1]]) + v * wide(mesh.normal[t[2]]));
    for (std::size_t k = 0; k < 2; ++k)
      hit.uv[k] = (1 - u - v) * mesh.texcoord[t[0]][k] + u * mesh.texcoord[t[1]][k] + v * mesh.texcoord[t[2]][k];
  }
  return hit;
}

void check(const Hit& hit, double distance, const Vec3& normal, const Vec2& uv) {
  CHECK(hit.distance == Approx(distance).margin(1e-3));  // chords: 2.4e-4 across, more where the ray is slanted
  for (std::size_t k = 0; k < 3; ++k) CHECK(hit.normal[k] == Approx(normal[k]).margin(0.01));
  for (std::size_t k = 0; k < 2; ++k) CHECK(hit.uv[k] == Approx(uv[k]).margin(0.003));
}

}  // namespace

TEST_CASE("linear curves are cones that touch balls at their points, as Mitsuba's") {
  const Mesh mesh = linear_curve_mesh({{{{0, 0, 0}, 0.1}, {{1, 0, 0}, 0.2}, {{1, 1, 0}, 0.1}}});
  const Vec3 down{0, 0, -1};
  check(shoot(mesh, {0.5, 1e-4, 5}, down), 4.8492, {-0.1, 0, 0.995}, {0.25, 0.2576});
  check(shoot(mesh, {0.5, -5, 1e-4}, {0, 1, 0}), 4.8492, {-0.1, -0.995, 0}, {0.5, 0.2576});
  check(shoot(mesh, {1, 0.5, 5}, down), 4.8492, {0, 0.1, 0.995}, {0.25, 0.7424});
  CHECK(shoot(mesh, {-0.05, 0, 5}, down).distance == Approx(4.9134).margin(5e-4));  // the ball at its beginning
  CHECK(shoot(mesh, {1.1, -0.1, 5}, down).distance == Approx(4.8586).margin(1e-3));
}

TEST_CASE("B-spline curves are as thick as Mitsuba's, where Mitsuba's are") {
  const Mesh mesh = bspline_curve_mesh(
      {{{{0, 0, 0}, 0.1}, {{1, 0, 0}, 0.2}, {{2, 1, 0}, 0.1}, {{3, 1, 0.5}, 0.15}, {{4, 0, 0}, 0.1}}});
  check(shoot(mesh, {1.5, 0.5, 5}, {0, 0, -1}), 4.8408, {-0.004, -0.003, 1}, {0.25, 0.253});
  check(shoot(mesh, {1.5, 5, 0}, {0, -1, 0}), 4.3212, {-0.549, 0.828, -0.112}, {0.9815, 0.2922});
  check(shoot(mesh, {2, 5, 0}, {0, -1, 0}), 4.0714, {-0.134, 0.699, -0.703}, {0.8707, 0.5093});
  CHECK(shoot(mesh, {0.9, 5, 0}, {0, -1, 0}).distance > 1e29);  // before the spline begins
}

TEST_CASE("of many points what lies inside of the curve is left out") {
  Curve curve;
  constexpr std::size_t points = 20'000;
  for (std::size_t i = 0; i < points; ++i)
    curve.push_back({{static_cast<double>(i), 0, 0.3 * std::sin(static_cast<double>(i))}, i % 2 ? 0.1 : 0.2});
  const Mesh mesh = linear_curve_mesh({curve});
  CHECK(mesh.triangle.size() < 60 * points);
  for (const std::size_t i : {std::size_t{0}, points / 2, points / 2 + 1, points - 1}) {
    const Vec3& p = curve[i].position;
    CHECK(shoot(mesh, {p[0], 1e-4, 5}, {0, 0, -1}).distance == Approx(5 - p[2] - curve[i].radius).margin(0.02));
    CHECK(shoot(mesh, {p[0], 5, p[2] + 1e-4}, {0, -1, 0}).distance == Approx(5 - curve[i].radius).margin(0.02));
  }
}

TEST_CASE("curves come from Mitsuba's files, and to_world leaves their radii") {
  SceneFolder folder;
  folder.write("c.txt", "0 0 0 0.1\n1 0 0 0.1\r\n\n\n0 3 0 0.1\n1 3 0 0.1\n2 3 0 0\n");
  CHECK(read_curves(folder.path("c.txt"), 2).size() == 2);
  const Scene scene = folder.load(
      "<shape type=\"linearcurve\"><string name=\"filename\" value=\"c.txt\"/><transform name=\"to_world\"><scale "
      "value=\"3\"/></transform></shape>");
  CHECK(shoot(*scene.shapes.at(0).mesh, {1.5, 1e-4, 5}, {0, 0, -1}).distance == Approx(4.9).margin(5e-4));
}

TEST_CASE("faulty curves are refused with their line") {
  SceneFolder folder;
  const auto error = [&](const std::string& text, const char* type = "linearcurve") {
    folder.write("c.txt", text);
    return folder.error_of("<shape type=\"" + std::string(type) +
                           "\"><string name=\"filename\" value=\"c.txt\"/></shape>");
  };
  using Catch::Contains;
  CHECK_THAT(error(""), Contains("no curve"));
  CHECK_THAT(error("0 0 0 1\n"), Contains("c.txt:1") && Contains("1 points") && Contains("need 2"));
  CHECK_THAT(error("0 0 0 1\n1 0 0 1\n2 0 0 1\n", "bsplinecurve"), Contains("3 points") && Contains("need 4"));
  CHECK_THAT(error("0 0 0 1\n1 0 0\n"), Contains("c.txt:2") && Contains("3 numbers"));
  CHECK_THAT(error("0 0 0 1 1\n"), Contains("more than four"));
  CHECK_THAT(error("0 0 0 -1\n1 0 0 1\n"), Contains("radius -1"));
  CHECK_THAT(error("0 0 x 1\n"), Contains("\"x\" is no number"));
  CHECK_THAT(error("0 0 nan 1\n1 0 0 1\n"), Contains("no number"));
  CHECK_THAT(error("0 0 1e39 1\n1 0 0 1\n"), Contains("no number"));
}
