// The ten shapes of the data set.
#include "runtime/scene/shapes/named_shapes.h"

#include <catch2/catch.hpp>
#include <map>

#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/shapes/polygonise.h"
#include "tests/shapes/mesh_checks.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

TEST_CASE("The ten shapes are closed, normalised, of 10^4 to 10^5 triangles and have the handles they should") {
  const std::map<std::string, int> handles{{"knot", 1}, {"urchin", 0}, {"spire", 0},   {"cup", 1},   {"hand", 0},
                                           {"hare", 0}, {"gear", 6},   {"serpent", 0}, {"teapot", 1}};
  std::map<std::string, const NamedShape*> found;
  int testing = 0;
  for (const NamedShape& shape : named_shapes()) {
    CAPTURE(shape.name);
    found[shape.name] = &shape;
    testing += shape.for_testing;
    CHECK(test::steepest_slope(shape.solid(), 2000) <= 1 + 1e-9);
    const Mesh mesh = shape.mesh();
    CHECK((mesh.triangle.size() >= 60000 && mesh.triangle.size() <= 100000));
    test::check_closed(mesh);
    test::check_normalised(mesh);
    if (shape.name == "sponge")
      CHECK(genus(mesh) > 20);
    else
      CHECK(genus(mesh) == handles.at(shape.name));
  }
  CHECK(found.size() == 10);
  CHECK(testing == 4);
}

TEST_CASE("A PLY file keeps the mesh bit by bit") {
  const TemporaryFolder folder;
  const Mesh mesh = polygonise(torus(0.7, 0.3), 0.2);
  write_ply(folder / "a.ply", mesh);
  const Mesh read = read_mesh(folder / "a.ply");
  CHECK(read.position == mesh.position);
  CHECK(read.normal == mesh.normal);
  CHECK(read.triangle == mesh.triangle);
  Mesh textured = mesh;
  textured.normal.clear();
  textured.texcoord.assign(mesh.position.size(), {0.25F, 0.75F});
  write_ply(folder / "b.ply", textured);
  const Mesh again = read_mesh(folder / "b.ply");
  CHECK(again.normal.empty());
  CHECK(again.texcoord == textured.texcoord);
}
