// Surfaces of fields on grids.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>

#include "runtime/scene/mesh/level_set_mesh.h"
#include "runtime/scene/mesh/mesh_close.h"
#include "runtime/scene/transform.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

// The distance to a ball around the middle of the cube.
LevelSet ball(std::array<std::size_t, 3> size, double radius) {
  LevelSet field{size, {}};
  for (std::size_t z = 0; z < size[2]; ++z)
    for (std::size_t y = 0; y < size[1]; ++y)
      for (std::size_t x = 0; x < size[0]; ++x) {
        const auto at = [](std::size_t i, std::size_t n) {
          return static_cast<double>(i) / static_cast<double>(n - 1) - 0.5;
        };
        field.value.push_back(static_cast<float>(std::hypot(at(x, size[0]), at(y, size[1]), at(z, size[2])) - radius));
      }
  return field;
}

// As a .vol file.
std::string volume_bytes(const LevelSet& field) {
  std::string bytes("VOL\3", 4);
  const auto add = [&](auto number) { bytes.append(reinterpret_cast<const char*>(&number), sizeof(number)); };
  add(std::int32_t{1});
  for (const std::size_t n : field.size) add(static_cast<std::int32_t>(n));
  add(std::int32_t{1});
  for (const float x : {0.0F, 0.0F, 0.0F, 1.0F, 1.0F, 1.0F}) add(x);
  for (const float x : field.value) add(x);
  return bytes;
}

Vec3 wide(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

TEST_CASE("the level set of a distance to a ball is the closed ball, with its normals") {
  for (const LevelSetNormals normals : {LevelSetNormals::smooth, LevelSetNormals::analytic}) {
    const Mesh mesh = level_set_mesh(ball({21, 25, 31}, 0.31), normals);
    const Topology found = topology(mesh);
    CHECK(found.open_edges == 0);
    CHECK(found.non_manifold_edges == 0);
    CHECK(found.turned_edges == 0);
    CHECK(found.volume == Approx(4.0 / 3 * M_PI * std::pow(0.31, 3)).epsilon(0.01));
    double far = 0, turned = 0;
    for (std::size_t i = 0; i < mesh.position.size(); ++i) {
      const Vec3 from = wide(mesh.position[i]) - Vec3{0.5, 0.5, 0.5};
      far = std::max(far, std::abs(length(from) - 0.31));
      turned = std::max(turned, length(normalize(from) - wide(mesh.normal[i])));
    }
    CHECK(far < 2.1e-3);  // of chords in two directions: 2 (1 / 20)^2 / (8 0.31)
    CHECK(turned < (normals == LevelSetNormals::smooth ? 0.03 : 0.12));
  }
}

TEST_CASE("level sets are open where they leave the cube, and empty where there are none") {
  const Mesh cut = level_set_mesh(ball({11, 11, 11}, 0.6), LevelSetNormals::smooth);
  CHECK(topology(cut).open_edges > 0);
  CHECK(topology(cut).turned_edges == 0);
  CHECK(level_set_mesh(ball({5, 5, 5}, 2), LevelSetNormals::smooth).triangle.empty());
}

TEST_CASE("a surface of more triangles than are worth it is refused with their number") {
  LevelSet noise;
  noise.size = {130, 130, 130};
  std::uint32_t state = 1;
  for (std::size_t i = 0; i < 130 * 130 * 130; ++i) {
    state = 1664525 * state + 1013904223;
    noise.value.push_back(state >> 31 ? 1.0F : -1.0F);
  }
  CHECK_THROWS_WITH(level_set_mesh(noise, LevelSetNormals::smooth),
                    Catch::Contains("1.5e+07 triangles") && Catch::Contains("resample"));
}

TEST_CASE("an sdfgrid is the mesh of its file, moved") {
  SceneFolder folder;
  const LevelSet field = ball({9, 9, 9}, 0.3);
  folder.write("ball.vol", volume_bytes(field));
  const std::string shape =
      "<shape type=\"sdfgrid\">\n<string name=\"filename\" value=\"ball.vol\"/><transform name=\"to_world\"><scale "
      "value=\"2\"/></transform>";
  const Scene scene = folder.load(shape + "</shape>");
  const Mesh smooth = level_set_mesh(field, LevelSetNormals::smooth);
  REQUIRE(scene.shapes.at(0).mesh);
  const Mesh& mesh = *scene.shapes[0].mesh;
  CHECK(mesh.triangle.size() <= smooth.triangle.size());
  double far = 0;
  for (std::size_t i = 0; i < mesh.position.size(); ++i)
    far = std::max(far, std::abs(length(wide(mesh.position[i]) - Vec3{1, 1, 1}) - 0.6));
  CHECK(far < 0.03);
  const Scene analytic = folder.load(shape + "<string name=\"normals\" value=\"analytic\"/></shape>");
  CHECK(analytic.shapes.at(0).mesh->position == mesh.position);
  CHECK(analytic.shapes.at(0).mesh->normal != mesh.normal);
  folder.check_error("<shape type=\"sdfgrid\">\n<string name=\"normals\" value=\"smooth\"/></shape>", 2, {"filename"});
  folder.check_error(shape + "<string name=\"normals\" value=\"flat\"/></shape>", 3, {"smooth", "analytic"});
  folder.write("ball.vol", volume_bytes(ball({5, 5, 5}, 2)));
  folder.check_error(shape + "</shape>", 3, {"one sign"});
  folder.write("ball.vol", volume_bytes({{1, 9, 9}, std::vector<float>(81, 1)}));
  folder.check_error(shape + "</shape>", 3, {"2 or more"});
}
