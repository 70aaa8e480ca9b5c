#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <random>

#include "runtime/render/compile/flight_grid.h"
#include "tests/geometry/geometry_device.h"

using namespace itn;
using namespace itn::test;

namespace {

// Flights as paths inside make them, and from a hair's breadth beside surfaces.
std::vector<TestRay> flights(const GeometryOnDevice& g, std::size_t n, double mean, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(0, 1);
  std::normal_distribution<float> normal;
  std::vector<TestRay> rays(n);
  const GeometryRecord& r = g.record();
  for (auto& ray : rays) {
    const float x = normal(random), y = normal(random), z = normal(random), l = std::sqrt(x * x + y * y + z * z);
    ray.direction = {x / l, y / l, z / l};
    for (std::size_t k = 0; k < 3; ++k) {
      const float size = static_cast<float>(r.cells[k]) * r.cell_size;
      ray.origin[k] = r.grid_low[k] + unit(random) * size;
    }
    ray.t_max = -std::log(1 - unit(random)) * static_cast<float>(mean);
  }
  // Half of them to the next surface, and then back or along by a random amount.
  for (std::size_t i = 0; i < n; i += 2) {
    const ExactHit hit = closest(g.geometry, {.origin = rays[i].origin, .direction = rays[i].direction});
    if (hit.primitive < 0) continue;
    const double back = hit.t - std::pow(10.0, -6 + 5 * unit(random));
    for (std::size_t k = 0; k < 3; ++k) rays[i].origin[k] += static_cast<float>(back) * rays[i].direction[k];
    rays[i].direction = rays[i + 1].direction;
  }
  return rays;
}

// Does the flight meet the front of the surface?
bool enters(const Geometry& geometry, const TestRay& ray, const ExactHit& hit) {
  const PrimitiveRecord& p = geometry.primitives[static_cast<std::size_t>(hit.primitive)];
  double along = 0, height = 0, square = 0;
  std::array<double, 3> from{};
  for (std::size_t k = 0; k < 3; ++k) {
    from[k] = ray.origin[k] + hit.t * ray.direction[k] - p.normal[k];
    height += from[k] * p.frame[6 + k];
    square += double{p.frame[6 + k]} * p.frame[6 + k];
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const double out = p.flags & PRIMITIVE_SPHERE     ? from[k]
                       : p.flags & PRIMITIVE_CYLINDER ? from[k] - height / square * p.frame[6 + k]
                                                      : p.normal[k];
    along += ray.direction[k] * out;
  }
  return (along < 0) != ((p.flags & PRIMITIVE_CURVED) && (p.flags & PRIMITIVE_FLIPPED));
}

// share: of ITN_RAYS flights when run by hand.
void check(const char* name, std::vector<Shape> shapes, std::size_t share, int width = 16) {
  const char* given = std::getenv("ITN_RAYS");
  const auto n = static_cast<std::size_t>(given ? std::atof(given) : 300'000) / share;
  const GeometryOnDevice g(scene_of(std::move(shapes)), width, 16);
  std::size_t accepted = 0;
  for (const double mean : {0.01, 0.05, 0.3}) {
    const auto rays = flights(g, n / 3, mean, 5);
    std::vector<int> clear;
    std::vector<float> distance;
    g.fly(rays, clear, distance);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!clear[i]) continue;
      ++accepted;
      const ExactHit hit = closest(g.geometry, rays[i], -1e-6);
      // Flights are promised to be clear inside a medium; one that enters began outside.
      if (hit.primitive >= 0 && enters(g.geometry, rays[i], hit)) continue;
      INFO(name << ": flight " << i << " of " << rays[i].t_max << " meets a surface at " << hit.t);
      REQUIRE(hit.primitive < 0);
    }
    // No surface within the distance bound: in any direction.
    for (std::size_t i = 0; i < rays.size(); ++i) {
      TestRay ray = rays[i];
      ray.t_max = distance[i];
      if (distance[i] > 0) REQUIRE(closest(g.geometry, ray).primitive < 0);
    }
  }
  INFO(name << ": " << accepted << " flights accepted of " << n);
  CHECK(accepted > n / 10);
}

}  // namespace

TEST_CASE("no flight that the grid accepts meets a surface") {
  check("knot", {shape_of(torus_knot(512, 64))}, 4);
  check("cube", {shape_of(cube(1))}, 10);
  check("spiky", {shape_of(spiky(3, 0.2f, 3))}, 10);
  check("star", {shape_of(star_plate(7, 0.05f))}, 10);
  check("sphere", {sphere({0.2, 0.1, -0.3}, 0.7)}, 10);
  Shape floor = disk({0, 0, -1}, {100, 0, 0}, {0, 100, 0});
  Shape ground = sphere({0, 0, -1001}, 1000);
  ground.interior = -1;
  check("sphere and knot over ground", {sphere({0, 0, 0}, 0.2), shape_of(torus_knot(64, 16)), floor, ground}, 10);
  // Seen from outside, both sides: flipped normals make what is met there count.
  std::vector<Shape> tubes{sphere({0, 0, 0}, 1), cylinder({0.1, 0.2, -0.6}, {0.3, -0.1, 0.5}, 0.2),
                           cylinder({-0.5, 0.4, 0}, {-0.5, 0.41, 0.1}, 0.3), cylinder({0, 0, -900}, {0, 1, 900}, 300)};
  for (std::size_t i = 1; i < 4; ++i) tubes[i].flip_normals = i < 3;
  check("sphere with cylinders", tubes, 10);
  check("knot, width 1", {shape_of(torus_knot(64, 16))}, 20, 1);
}

TEST_CASE("the grid ends where surfaces cannot be cut finer or are too many, and is then none") {
  const auto cells_of = [](std::vector<Shape> shapes) {
    return build_flight_grid(scene_of(std::move(shapes))).cells[0];
  };
  CHECK(cells_of({sphere({0, 0, 0}, 1)}) > 0);
  for (const double x : {1e4, 3e5, 1e6, 1e7, 1e12}) {
    CHECK(cells_of({sphere({x, 0, 0}, 1)}) == 0);
    CHECK(cells_of({cylinder({x, 0, 0}, {x, 0, 1}, 1)}) == 0);
    CHECK(cells_of({sphere({0, 0, 0}, 1), sphere({x, 0, 0}, 1)}) >= 0);
    Shape ground = sphere({0, 0, -x}, x - 1.5);
    ground.interior = -1;
    CHECK(cells_of({sphere({0, 0, 0}, 1), ground}) >= 0);
    Shape floor = disk({0, 0, -1.5}, {x, 0, 0}, {0, x, 0});
    CHECK(cells_of({sphere({0, 0, 0}, 1), floor}) >= 0);
    Mesh plane;
    const auto far = static_cast<float>(x);
    plane.position = {{-far, -far, -1.5F}, {far, -far, -1.5F}, {0, far, -1.5F}};
    plane.triangle = {{0, 1, 2}};
    Shape triangle = shape_of(plane);
    triangle.interior = -1;
    CHECK(cells_of({sphere({0, 0, 0}, 1), triangle}) > 0);
  }
  std::vector<Shape> many;
  for (int i = 0; i < 2000; ++i) many.push_back(sphere({0, 0, 0}, 1 + 1e-6 * i));
  CHECK(cells_of(many) == 0);
}

TEST_CASE("speed of the grid", "[.bench]") {
  const Scene scene = scene_of({shape_of(torus_knot(512, 64))});
  for (int i = 0; i < 3; ++i) {
    const Stopwatch watch;
    const FlightGrid grid = build_flight_grid(scene);
    WARN("grid of " << grid.cells[0] << " x " << grid.cells[1] << " x " << grid.cells[2] << " in " << watch);
  }
  const GeometryOnDevice g(scene, 16, 16);
  for (const double sigma_t : {25.0, 100.0, 300.0}) {
    const auto rays = g.paths({1, 0, 0}, 1 / sigma_t, 0.95, 1'000'000, 11);
    std::vector<int> clear;
    std::vector<float> distance;
    Seconds time;
    g.fly(rays, clear, distance, &time);
    std::size_t accepted = 0;
    for (const int c : clear) accepted += c != 0;
    WARN("sigma_t " << sigma_t << ": " << 100.0 * static_cast<double>(accepted) / static_cast<double>(rays.size())
                    << " % of flights need no ray test, " << static_cast<double>(rays.size()) / time.core * 1e-6
                    << " million/s a core");
  }
}
