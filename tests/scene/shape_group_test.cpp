// Instances of shape groups: copies of the group's shapes, moved.
#include <cmath>

#include "runtime/scene/mesh/mesh_topology.h"
#include "runtime/scene/transform.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

std::string group(const std::string& content) {
  return "<shape type=\"shapegroup\" id=\"g\">\n" + content + "</shape>\n";
}
std::string instance(const std::string& steps = "") {
  return "<shape type=\"instance\"><ref id=\"g\"/>" +
         (steps.empty() ? "" : "<transform name=\"to_world\">" + steps + "</transform>") + "</shape>\n";
}
const std::string cube =
    "<shape type=\"cube\"><transform name=\"to_world\"><translate x=\"3\"/></transform>"
    "<medium type=\"homogeneous\" name=\"interior\"/><bsdf type=\"null\"/></shape>";

}  // namespace

TEST_CASE("a group is seen only where it has instances, before or after it in the file") {
  SceneFolder folder;
  CHECK(folder.load(group(cube)).shapes.empty());
  const Scene scene = folder.load(instance() + group(cube) + instance("<translate z=\"5\"/>"));
  REQUIRE(scene.shapes.size() == 2);
  CHECK(scene.shapes[0].mesh->position[0] == std::array<float, 3>{4, -1, -1});
  CHECK(scene.shapes[1].mesh->position[0] == std::array<float, 3>{4, -1, 4});
}

TEST_CASE("all instances have the group's materials and media") {
  const Scene scene = SceneFolder().load(group(cube + "<shape type=\"sphere\"/>") + instance() + instance());
  REQUIRE(scene.shapes.size() == 4);
  CHECK(scene.media.size() == 1);
  CHECK(scene.bsdfs.size() == 2);
  CHECK(scene.shapes[0].interior == 0);
  CHECK(scene.shapes[2].interior == 0);
  CHECK(scene.shapes[1].bsdf == scene.shapes[3].bsdf);
  CHECK(scene.shapes[1].bsdf != scene.shapes[0].bsdf);
}

TEST_CASE("an instance's transform applies after the shape's own, and a reflection leaves the outside outside") {
  const Scene scene = SceneFolder().load(group(cube) + instance("<scale x=\"-2\"/><rotate z=\"1\" angle=\"90\"/>"));
  const Mesh& mesh = *scene.shapes[0].mesh;
  const Topology t = topology(mesh);
  CHECK(t.closed());
  CHECK(t.volume == Approx(16));
  for (const auto& p : mesh.position) CHECK(p[1] < -3.9f);  // x from 2 to 4 goes to -4 to -8, then to y
}

TEST_CASE("spheres, disks and cylinders are moved as they are") {
  const Scene scene = SceneFolder().load(
      group("<shape type=\"sphere\"><point name=\"center\" value=\"1 0 0\"/></shape><shape type=\"disk\"/>"
            "<shape type=\"cylinder\"/>") +
      instance("<scale value=\"-2\"/><translate y=\"1\"/>"));
  REQUIRE(scene.shapes.size() == 3);
  CHECK(scene.shapes[0].center == Vec3{-2, 1, 0});
  CHECK(scene.shapes[0].radius == 2);
  CHECK(!scene.shapes[0].flip_normals);  // Mitsuba 3.9.1: the normal of an instance is moved with it
  const Shape& disk = scene.shapes[1];
  CHECK(((disk.flip_normals ? -1 : 1) * cross(disk.edge_u, disk.edge_v))[2] < 0);
  CHECK(scene.shapes[2].axis == Vec3{0, 0, -2});
  CHECK(scene.shapes[2].radius == 2);
}

TEST_CASE("an instance that is scaled unevenly makes an ellipsoid of a sphere, as a mesh that is as large") {
  const Scene scene =
      SceneFolder().load(group("<shape type=\"sphere\"><point name=\"center\" value=\"1 0 0\"/></shape>") +
                         instance("<scale x=\"-2\" y=\"1\" z=\"0.5\"/>"));
  REQUIRE(scene.shapes.size() == 1);
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("scene.xml:3:1") && Catch::Contains("ellipsoid"));
  const Mesh& mesh = *scene.shapes[0].mesh;
  CHECK(topology(mesh).closed());
  CHECK(topology(mesh).volume == Approx(4 * M_PI / 3).epsilon(1e-5));
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    const auto& p = mesh.position[i];
    const Vec3 gradient = normalize({(p[0] + 2) / 4, p[1], p[2] / 0.25});
    CHECK(std::abs((p[0] + 2) * (p[0] + 2) / 4 + p[1] * p[1] + p[2] * p[2] / 0.25 - 1) < 3e-4);
    CHECK(dot(gradient, Vec3{mesh.normal[i][0], mesh.normal[i][1], mesh.normal[i][2]}) > 0.9999);
  }
}

TEST_CASE("faulty groups and instances are refused") {
  SceneFolder folder;
  folder.check_error(group("<shape type=\"shapegroup\"><shape type=\"sphere\"/></shape>"), 3, {"cannot be nested"});
  folder.check_error(group("<shape type=\"instance\"><ref id=\"g\"/></shape>") + instance(), 2,
                     {"contains a reference to itself"});
  folder.check_error("<shape type=\"instance\"/>", 2, {"no shapegroup", "<ref"});
  folder.check_error("<shape type=\"sphere\" id=\"g\"/>\n" + instance(), 3, {"no shapegroup"});
  folder.check_error(group("<bsdf type=\"diffuse\"/>"), 3, {"does not belong here"});
  folder.check_error(group("<shape type=\"sphere\"/>") + instance("<scale value=\"1e30\"/><scale value=\"1e30\"/>"), 4,
                     {"single precision"});
}
