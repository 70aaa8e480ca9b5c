// Random shapes.
#include "runtime/scene/shapes/random_shape.h"

#include <catch2/catch.hpp>
#include <map>
#include <set>

#include "runtime/scene/mesh/mesh_topology.h"
#include "runtime/scene/shapes/polygonise.h"
#include "tests/shapes/mesh_checks.h"

using namespace itn;

TEST_CASE("200 random shapes are closed solids that differ, from every family, nowhere steeper than 1") {
  std::map<std::string, int> families;
  std::set<double> volumes;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const RandomShape shape = random_shape(seed);
    CAPTURE(seed, shape.family);
    ++families[shape.family];
    CHECK(test::steepest_slope(shape.solid, 100) <= 1 + 1e-9);
    const Mesh mesh = polygonise(shape.solid, 0.09);
    test::check_closed(mesh);
    volumes.insert(topology(mesh).volume);
  }
  CHECK(volumes.size() == 200);
  CHECK(families.size() == random_families().size());
  for (const auto& [name, count] : families) {
    CAPTURE(name);
    CHECK(count >= 5);
  }
}

TEST_CASE(
    "Random shapes of full size are normalised, of 10^4 to 10^5 triangles, and stout enough for light to matter") {
  for (std::uint64_t seed = 1000; seed < 1008; ++seed) {
    const Mesh mesh = random_shape(seed).mesh();
    CAPTURE(seed, mesh.triangle.size());
    CHECK((mesh.triangle.size() >= 10000 && mesh.triangle.size() <= 100000));
    test::check_closed(mesh);
    test::check_normalised(mesh);
    CHECK(topology(mesh).volume > 0.002);
  }
}

TEST_CASE("The same seed gives the same mesh, another seed another") {
  const Mesh a = random_shape(7).mesh(10000), b = random_shape(7).mesh(10000), c = random_shape(8).mesh(10000);
  CHECK(a.position == b.position);
  CHECK(a.normal == b.normal);
  CHECK(a.triangle == b.triangle);
  CHECK(a.position != c.position);
  CHECK(random_shape(~std::uint64_t(0)).mesh(10000).triangle.size() > 100);
}
