// Meshes that are nearly closed become closed, or stay as they are and say where the fault is.
#include "runtime/scene/mesh/mesh_close.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "runtime/scene/mesh/hole_filling.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/mesh/mesh_repair.h"
#include "runtime/scene/transform.h"
#include "tests/scene/scene_folder.h"
#include "tests/support/meshes.h"

using namespace itn;
using namespace itn::test;

namespace {

// [low, low + size]^3 with n x n squares a face, each corner of a face a vertex of its own.
Mesh grid_cube(int n, const Vec3& low = {0, 0, 0}, double size = 1) {
  Mesh mesh;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const auto first = static_cast<std::uint32_t>(mesh.position.size()), row = static_cast<std::uint32_t>(n) + 1;
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) {
          std::array<float, 3> p{};
          p[axis] = static_cast<float>(low[axis] + side * size);
          p[(axis + 1) % 3] = static_cast<float>(low[(axis + 1) % 3] + size * i / n);
          p[(axis + 2) % 3] = static_cast<float>(low[(axis + 2) % 3] + size * j / n);
          mesh.position.push_back(p);
        }
      for (std::uint32_t j = 0; j + 1 < row; ++j)
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
          const std::uint32_t a = first + j * row + i, b = a + 1, c = a + row, d = c + 1;
          mesh.triangle.push_back(side ? std::array{a, b, d} : std::array{a, d, b});
          mesh.triangle.push_back(side ? std::array{a, d, c} : std::array{a, c, d});
        }
    }
  return mesh;
}

Mesh joined(Mesh a, const Mesh& b) {
  const auto first = static_cast<std::uint32_t>(a.position.size());
  a.position.insert(a.position.end(), b.position.begin(), b.position.end());
  for (const auto& t : b.triangle) a.triangle.push_back({first + t[0], first + t[1], first + t[2]});
  return a;
}

void check_closed(const Mesh& mesh, double volume, double tolerance = 1e-6) {
  const Topology t = topology(mesh);
  CHECK(t.closed());
  CHECK(t.volume == Approx(volume).epsilon(tolerance));
}

// Closing fails and changes nothing.
Topology check_refused(Mesh mesh) {
  const Mesh before = mesh;
  const Topology left = close_mesh(mesh).left;
  CHECK(!left.closed());
  CHECK(mesh.position == before.position);
  CHECK(mesh.triangle == before.triangle);
  return left;
}

double area_of_triangles(const std::vector<Vec3>& loop) {
  double area = 0;
  for (const auto& t : triangulate_loop(loop))
    area += length(cross(loop[t[1]] - loop[t[0]], loop[t[2]] - loop[t[0]])) / 2;
  return area;
}

}  // namespace

TEST_CASE("a closed mesh is left as it is") {
  for (const Mesh& whole : {grid_cube(3), icosphere(2), torus_knot(64, 12)}) {
    Mesh mesh = whole;
    const Closing closing = close_mesh(mesh);
    CHECK(!closing.changes_mesh());
    CHECK(mesh.triangle == whole.triangle);
    CHECK(mesh.position == whole.position);
  }
}

TEST_CASE("a small hole gets triangles: the mesh is closed, its volume right, and it is said what was done") {
  Mesh mesh = grid_cube(6);
  mesh.triangle.erase(mesh.triangle.begin() + 14);
  Closing closing = close_mesh(mesh);
  CHECK(closing.summary() == "closed 1 hole with 1 triangle");
  check_closed(mesh, 1);

  mesh = grid_cube(6);
  mesh.triangle.erase(mesh.triangle.begin() + 26, mesh.triangle.begin() + 30);  // two neighbouring squares
  mesh.triangle.erase(mesh.triangle.begin() + 200);
  closing = close_mesh(mesh);
  CHECK(closing.summary() == "closed 2 holes with 5 triangles");
  check_closed(mesh, 1);
}

TEST_CASE("a hole around a corner is closed across it") {
  Mesh mesh = grid_cube(8);
  const std::array<float, 3> corner{1, 1, 1};
  std::erase_if(mesh.triangle, [&](const auto& t) {
    return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.position[v] == corner; });
  });
  const Closing closing = close_mesh(mesh);
  CHECK(closing.holes == 1);
  check_closed(mesh, 1, 0.002);  // the corner, of volume 1/6 / 8^3 and a little more, is cut off
}

TEST_CASE("holes that touch at a vertex are closed one by one") {
  Mesh mesh = grid_cube(8);
  // Squares (2, 2) and (3, 3) of the first face.
  std::vector<std::array<std::uint32_t, 3>> kept;
  for (std::size_t i = 0; i < mesh.triangle.size(); ++i)
    if (i / 2 != 2 * 8 + 2 && i / 2 != 3 * 8 + 3) kept.push_back(mesh.triangle[i]);
  mesh.triangle = kept;
  const Closing closing = close_mesh(mesh);
  CHECK(closing.holes == 2);
  CHECK(closing.hole_triangles == 4);
  check_closed(mesh, 1);
}

TEST_CASE("a large hole is left, with its place, and then nothing else is changed either") {
  Mesh mesh = grid_cube(6);
  std::erase_if(mesh.triangle, [&](const auto& t) {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.position[v][2] == 1; });
  });
  mesh.triangle.erase(mesh.triangle.begin() + 14);  // a small one beside it
  const Topology left = check_refused(mesh);
  CHECK(left.open_edges == 24);
  CHECK(left.open_at.middle[2] == 1);
  const auto& t = mesh.triangle.at(left.open_at.triangle);
  CHECK(std::count_if(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.position[v][2] == 1; }) == 2);
}

TEST_CASE("a sheet gets no lid, which would lie upon it") {
  Mesh sheet = grid_cube(10);
  sheet.triangle.resize(200);  // one face
  check_refused(sheet);
  Mesh stray;
  stray.position = {{3, 0, 0}, {3.1f, 0, 0}, {3, 0.1f, 0}};
  stray.triangle = {{0, 1, 2}};
  check_refused(joined(grid_cube(4), stray));
}

TEST_CASE("seams whose vertices nearly coincide are welded") {
  // Every face of the cube stands apart from the others by less than the tolerance.
  Mesh mesh = grid_cube(5);
  std::mt19937 random(1);
  for (auto& p : mesh.position)
    for (float& x : p) x += 2e-5f * (static_cast<float>(random() % 1000) / 1000 - 0.5f);
  const Topology before = topology(mesh);
  CHECK(before.open_edges == 6 * 4 * 5);
  const Closing closing = close_mesh(mesh);
  CHECK(closing.holes == 0);
  CHECK(closing.welded > 60);
  CHECK_THAT(closing.summary(), Catch::Contains("welded") && Catch::Contains("along seams"));
  check_closed(mesh, 1, 1e-4);
}

TEST_CASE("a seam whose sides have different vertices is zipped by triangles") {
  // The face z = 1 has twice as many squares as its neighbours.
  Mesh mesh = grid_cube(4), fine = grid_cube(8);
  const auto on_top = [](const Mesh& m, const std::array<std::uint32_t, 3>& t) {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return m.position[v][2] == 1; });
  };
  std::erase_if(mesh.triangle, [&](const auto& t) { return on_top(mesh, t); });
  std::erase_if(fine.triangle, [&](const auto& t) { return !on_top(fine, t); });
  mesh = joined(mesh, fine);
  const Closing closing = close_mesh(mesh);
  CHECK(closing.hole_triangles == 16);  // one for each side of a square that is two on the other side
  check_closed(mesh, 1);
}

TEST_CASE("an edge of four triangles is in order when they wind as often one way as the other") {
  Mesh mesh = joined(grid_cube(1), grid_cube(1, {1, 1, 0}));
  const Topology t = topology(mesh);
  CHECK(t.closed());
  CHECK(t.shared_edges == 1);
  CHECK(!close_mesh(mesh).changes_mesh());
  check_closed(mesh, 2);
}

TEST_CASE("bodies that share a face become one: the two faces cancel") {
  Mesh mesh = joined(grid_cube(2), grid_cube(2, {1, 0, 0}));
  const Closing closing = close_mesh(mesh);
  CHECK(closing.summary() == "dropped 16 triangles that others cover or cancel");
  CHECK(mesh.triangle.size() == 2 * 48 - 16);
  check_closed(mesh, 2);
}

TEST_CASE("triangles given twice count once") {
  Mesh mesh = grid_cube(4);
  for (int i = 0; i < 5; ++i) mesh.triangle.push_back(mesh.triangle[static_cast<std::size_t>(11 * i)]);
  const auto turn = mesh.triangle[60];
  mesh.triangle.push_back({turn[1], turn[2], turn[0]});
  CHECK(close_mesh(mesh).duplicates == 6);
  CHECK(mesh.triangle.size() == 192);
  check_closed(mesh, 1);
}

TEST_CASE("a wall inside and a fin outside are taken out") {
  // A step of letters, as in the paper's soap: a box on the cube, whose floor is still there.
  Mesh mesh = joined(grid_cube(10), grid_cube(1, {0.4, 0.4, 1}, 0.1));
  const auto floor_of_box = [&](const std::array<std::uint32_t, 3>& t) {
    return t[0] >= 726 && std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.position[v][2] == 1; });
  };
  for (auto& t : mesh.triangle)
    if (floor_of_box(t)) std::swap(t[1], t[2]);  // else the cube's top would cancel it
  const Topology before = topology(mesh);
  CHECK(before.non_manifold_edges == 4);
  const Closing closing = close_mesh(mesh);
  CHECK(closing.wall_triangles == 2);
  check_closed(mesh, 1.001, 1e-5);

  Mesh fin = grid_cube(4);
  fin.position.push_back({1.1f, 0.5f, 0.5f});
  fin.triangle.push_back(
      {fin.triangle[40][0], fin.triangle[40][1], static_cast<std::uint32_t>(fin.position.size()) - 1});
  CHECK(close_mesh(fin).wall_triangles == 1);
  check_closed(fin, 1);
}

TEST_CASE("a large fin and edges that wind against each other are refused with their places") {
  Mesh fin = grid_cube(2);
  fin.position.push_back({5, 0, 0});
  const auto far = static_cast<std::uint32_t>(fin.position.size()) - 1;
  fin.triangle.push_back({fin.triangle[8][0], fin.triangle[8][1], far});
  const Topology t = check_refused(fin);
  CHECK(t.non_manifold_edges == 1);

  Mesh turned = grid_cube(2);
  std::swap(turned.triangle[7][1], turned.triangle[7][2]);
  const Topology u = check_refused(turned);
  CHECK(u.turned_edges == 3);
}

TEST_CASE("a sheet of paper, each triangle there and back, is not taken away") {
  Mesh mesh = grid_cube(2);
  mesh.triangle.resize(8);
  for (std::size_t i = 0; i < 8; ++i)
    mesh.triangle.push_back({mesh.triangle[i][0], mesh.triangle[i][2], mesh.triangle[i][1]});
  const Closing closing = close_mesh(mesh);
  CHECK(!closing.changes_mesh());
  CHECK(mesh.triangle.size() == 16);
  CHECK(closing.left.volume == 0);
}

TEST_CASE("100 spheres with made-up damage are closed, with the volume of the whole one") {
  const Mesh whole = icosphere(3);
  const double volume = topology(whole).volume;
  std::mt19937 random(3);
  std::size_t holes = 0, welded = 0, duplicates = 0;
  for (int run = 0; run < 100; ++run) {
    Mesh mesh = whole;
    // Each triangle gets vertices of its own, near the old ones, on a part of the sphere.
    for (auto& t : mesh.triangle)
      if (mesh.position[t[0]][0] > 0.5f)
        for (std::uint32_t& v : t) {
          std::array<float, 3> p = mesh.position[v];
          for (float& x : p) x *= 1 + 1e-6f * static_cast<float>(random() % 100);
          v = static_cast<std::uint32_t>(mesh.position.size());
          mesh.position.push_back(p);
        }
    for (std::uint32_t k = 0; k < 5; ++k) {
      const auto i = static_cast<std::ptrdiff_t>(random() % mesh.triangle.size());
      mesh.triangle.erase(mesh.triangle.begin() + i);
    }
    for (int k = 0; k < 3; ++k) mesh.triangle.push_back(mesh.triangle[random() % 1000]);
    std::shuffle(mesh.triangle.begin(), mesh.triangle.end(), random);
    const Closing closing = close_mesh(mesh);
    CHECK(closing.left.closed());
    check_closed(mesh, volume, 0.003);
    holes += closing.holes;
    welded += closing.welded;
    duplicates += closing.duplicates;
  }
  CHECK(holes > 450);
  CHECK(welded > 10000);
  CHECK(duplicates >= 300);
}

TEST_CASE("a polygon's triangles cover its area, whether it is convex or not, and run along its sides") {
  CHECK(area_of_triangles({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}) == Approx(1));
  // An L, and a comb with teeth.
  CHECK(area_of_triangles({{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}}) == Approx(3));
  std::vector<Vec3> comb{{0, -1, 0}, {10, -1, 0}};
  for (int i = 10; i > 0; --i) {
    comb.push_back({double(i), 0, 0});
    comb.push_back({i - 0.5, 5, 0});
  }
  comb.push_back({0, 0, 0});
  CHECK(area_of_triangles(comb) == Approx(10 + 10 * 2.5));
  const auto triangles = triangulate_loop(comb);
  CHECK(triangles.size() == comb.size() - 2);
  for (std::uint32_t i = 0; i < comb.size(); ++i) {
    const std::uint32_t next = (i + 1) % static_cast<std::uint32_t>(comb.size());
    CHECK(std::count_if(triangles.begin(), triangles.end(), [&](const auto& t) {
            return (t[0] == i && t[1] == next) || (t[1] == i && t[2] == next) || (t[2] == i && t[0] == next);
          }) == 1);
  }
}

TEST_CASE("vertices that no triangle has are dropped, the others keep what they have") {
  Mesh mesh;
  mesh.position = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {8, 8, 8}, {0, 1, 0}};
  mesh.normal = {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}};
  mesh.triangle = {{1, 2, 4}};
  drop_unused_vertices(mesh);
  CHECK(mesh.position == std::vector<std::array<float, 3>>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  CHECK(mesh.normal == std::vector<std::array<float, 3>>{{0, 0, 1}, {0, 1, 0}, {0, 0, -1}});
  CHECK(mesh.triangle[0] == std::array<std::uint32_t, 3>{0, 1, 2});
}

namespace {

std::string shape(const std::string& content) {
  return "<shape type=\"ply\">\n<string name=\"filename\" value=\"m.ply\"/>" + content + "</shape>";
}
const std::string medium = "<medium type=\"homogeneous\" name=\"interior\"/><bsdf type=\"null\"/>";

}  // namespace

TEST_CASE("a scene says in one line what was done to a mesh, and where no medium is nothing is done") {
  SceneFolder folder;
  Mesh mesh = grid_cube(6);
  mesh.triangle.erase(mesh.triangle.begin() + 14);
  mesh.position.push_back({100, 100, 100});
  write_ply(folder.path("m.ply"), mesh);
  const Scene mended = folder.load(shape(medium));
  REQUIRE(mended.warnings.size() == 1);
  CHECK_THAT(mended.warnings[0],
             Catch::Contains("scene.xml:2:1: ") && Catch::Contains("closed 1 hole with 1 triangle"));
  check_closed(*mended.shapes[0].mesh, 1);
  CHECK(mended.shapes[0].mesh->position.size() == 6 * 49);
  CHECK(mended.shapes[0].mesh->normal.size() == 6 * 49);
  const Scene plain = folder.load(shape(""));
  CHECK(plain.warnings.empty());
  CHECK(plain.shapes[0].mesh->triangle.size() == mesh.triangle.size());
  // Turned around in the scene, the closed mesh is as much inside out as the whole one would be, and mended like it.
  const Scene turned = folder.load(shape(medium + "<boolean name=\"flip_normals\" value=\"true\"/>"));
  REQUIRE(turned.warnings.size() == 2);
  CHECK_THAT(turned.warnings[0], Catch::Contains("inside out"));
  check_closed(*turned.shapes[0].mesh, 1);
}

TEST_CASE("what cannot be closed is refused with the place and the remedy, and loaded as it is on request") {
  SceneFolder folder;
  Mesh mesh = grid_cube(6);
  mesh.triangle.erase(mesh.triangle.begin(), mesh.triangle.begin() + 72);  // the face x = 0
  write_ply(folder.path("m.ply"), mesh);
  folder.check_error(shape(medium), 2,
                     {"24 open edges", "one at (0, ", "of triangle ", "5 % of the area", "modeller", "(open)"});
  const Scene scene = load_scene(folder.path("scene.xml"), {}, {.open = true});
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("24 open edges") && Catch::Contains("rendered as it is (open)"));
  CHECK(scene.shapes[0].mesh->triangle.size() == mesh.triangle.size());
  CHECK(scene.shapes[0].interior == 0);
}

TEST_CASE("values of triangles and vertices follow what becomes of these") {
  Mesh mesh = grid_cube(4);
  mesh.triangle.erase(mesh.triangle.begin() + 20);  // a hole
  mesh.triangle.push_back(mesh.triangle[3]);        // twice
  MeshAttribute faces{"face_weight", 1, {}}, vertices{"vertex_color", 3, {}};
  for (const auto& t : mesh.triangle) faces.values.push_back(static_cast<float>(t[0] + t[1] + t[2]));
  for (const auto& p : mesh.position) vertices.values.insert(vertices.values.end(), p.begin(), p.end());
  mesh.attributes = {faces, vertices};
  mesh.position.push_back({9, 9, 9});  // used by none
  for (int c = 0; c < 3; ++c) mesh.attributes[1].values.push_back(9);
  const std::size_t given = mesh.triangle.size();
  const Closing closing = close_mesh(mesh);
  REQUIRE(closing.left.closed());
  REQUIRE(mesh.attributes[0].values.size() == mesh.triangle.size());
  std::size_t same = 0;
  for (std::size_t i = 0; i < mesh.triangle.size(); ++i) {
    const auto& t = mesh.triangle[i];
    same += mesh.attributes[0].values[i] == static_cast<float>(t[0] + t[1] + t[2]);
  }
  CHECK(same >= given - 2);  // all but what fills the hole
  drop_degenerate(mesh);
  drop_unused_vertices(mesh);
  CHECK(mesh.attributes[0].values.size() == mesh.triangle.size());
  REQUIRE(mesh.attributes[1].values.size() == 3 * mesh.position.size());
  for (std::size_t i = 0; i < mesh.position.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      CHECK(mesh.attributes[1].values[3 * i + c] == Approx(mesh.position[i][c]).margin(1e-3));
}
