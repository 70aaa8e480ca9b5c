// Meshes from solids.
#include "runtime/scene/shapes/polygonise.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "runtime/scene/mesh/mesh_topology.h"
#include "runtime/scene/transform.h"
#include "tests/shapes/mesh_checks.h"

using namespace itn;

namespace {

constexpr double pi = std::numbers::pi;

// Far steeper than 1 and full of noise: what no solid is, but the mesh must be closed all the same.
double noise(const Vec3& p) {
  const double waves = std::sin(37 * p[0] + 3) * std::sin(41 * p[1]) + std::sin(43 * p[2] + p[0]) * std::cos(29 * p[1]);
  return length(p) - 0.8 + 0.5 * waves;
}

double smallest_angle(const Mesh& mesh) {
  double smallest = pi;
  for (const auto& t : mesh.triangle)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto corner = [&](std::size_t k) {
        const auto& p = mesh.position[t[k % 3]];
        return Vec3{p[0], p[1], p[2]};
      };
      const Vec3 u = normalize(corner(i + 1) - corner(i)), v = normalize(corner(i + 2) - corner(i));
      smallest = std::min(smallest, std::acos(std::clamp(dot(u, v), -1.0, 1.0)));
    }
  return smallest * 180 / pi;
}

}  // namespace

TEST_CASE("A ball's mesh has the ball's volume, normals and distances to second order of the cell") {
  double volume_error[2];
  for (const int i : {0, 1}) {
    const double cell = i == 0 ? 0.12 : 0.06;
    const Mesh mesh = polygonise(ball({0, 0, 0}, 1), cell);
    test::check_closed(mesh);
    CHECK(genus(mesh) == 0);
    const double farthest = 0.25 * cell * cell;
    volume_error[i] = std::abs(topology(mesh).volume - 4 * pi / 3);
    for (std::size_t v = 0; v < mesh.position.size(); ++v) {
      const auto &p = mesh.position[v], &n = mesh.normal[v];
      const Vec3 position{p[0], p[1], p[2]}, normal{n[0], n[1], n[2]};
      REQUIRE(std::abs(length(position) - 1) < farthest);
      REQUIRE(dot(normalize(position), normal) > 1 - 0.02 * cell);
    }
    CHECK(volume_error[i] < 4 * pi * farthest);
  }
  CHECK(volume_error[0] / volume_error[1] == Approx(4).epsilon(0.2));
}

TEST_CASE("Genus is the number of handles") {
  CHECK(genus(polygonise(torus(0.8, 0.3), 0.1)) == 1);
  const Solid plate = box({1, 1, 0.2});
  Solid holes = plate;
  for (const double x : {-0.6, 0.0, 0.6}) holes = subtract(holes, moved(cylinder(0.2, 1), {x, 0.1, 0}));
  CHECK(genus(polygonise(holes, 0.08)) == 3);
}

TEST_CASE("The mesh of any function is closed and does not meet itself") {
  const Solid solids[] = {noise, intersect(box({0.8, 0.8, 0.8}), gyroid(0.7, 0.1)),
                          unite({box({0.5, 0.5, 0.5}), moved(box({0.5, 0.5, 0.5}), {0.5, 0.5, 0.5})}),
                          extruded(polygon(star_corners(5, 1, 0.1)), 0.3), ball({0, 0, 1.9}, 0.5)};
  for (const Solid& solid : solids) {
    const Mesh mesh = polygonise(solid, 0.1);
    CAPTURE(mesh.triangle.size());
    test::check_closed(mesh);
    CHECK(test::intersections(mesh) == 0);
  }
}

TEST_CASE("Smooth solids give triangles without small angles") {
  CHECK(smallest_angle(polygonise(torus(0.7, 0.3), 0.05)) > 10);
  CHECK(smallest_angle(polygonise(ball({0.01, 0.02, 0.03}, 1), 0.05)) > 10);
}

TEST_CASE("Only the largest piece is kept, without its cavities") {
  const Solid shells = unite({shell(ball({0, 0, 0}, 0.8), 0.4), ball({1.6, 0, 0}, 0.3)});
  const Mesh mesh = polygonise(shells, 0.1);
  test::check_closed(mesh);
  CHECK(genus(mesh) == 0);
  CHECK(topology(mesh).volume == Approx(4 * pi / 3).epsilon(0.03));
}

TEST_CASE("A shape's mesh is normalised and has about the triangles asked for") {
  for (const int triangles : {5000, 50000}) {
    const Mesh mesh = shape_mesh(moved(torus(0.5, 0.2), {0.3, 0.4, 0.5}), triangles);
    test::check_normalised(mesh);
    CHECK(static_cast<double>(mesh.triangle.size()) == Approx(triangles).epsilon(0.2));
  }
}

TEST_CASE("Parts thinner than asked for are not lost altogether, and nothing at all is an error") {
  const Mesh plate = shape_mesh(box({1, 1, 0.03}), 1000);
  test::check_closed(plate);
  CHECK(topology(plate).volume == Approx(0.03).epsilon(0.3));
  CHECK_THROWS_AS(polygonise(box({1, 1, 0.001}), 0.2), std::invalid_argument);
  CHECK_THROWS_AS(shape_mesh([](const Vec3&) { return 5.0; }, 1000), std::invalid_argument);
}
