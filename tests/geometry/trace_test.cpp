#include <catch2/catch.hpp>
#include <cstdlib>
#include <cstring>
#include <random>

#include "tests/geometry/geometry_device.h"

using namespace itn;
using namespace itn::test;

namespace {

using Point = std::array<float, 3>;

Point random_direction(std::mt19937& random) {
  std::normal_distribution<float> normal;
  const float x = normal(random), y = normal(random), z = normal(random), l = std::sqrt(x * x + y * y + z * z);
  return {x / l, y / l, z / l};
}

Point random_point(std::mt19937& random, float half) {
  std::uniform_real_distribution<float> place(-half, half);
  const float x = place(random), y = place(random), z = place(random);
  return {x, y, z};
}

TestRay towards(const Point& origin, const Vec3& target) {
  Vec3 d{target[0] - origin[0], target[1] - origin[1], target[2] - origin[2]};
  const double l = std::hypot(d[0], d[1], d[2]);
  return {.origin = origin,
          .direction = {static_cast<float>(d[0] / l), static_cast<float>(d[1] / l), static_cast<float>(d[2] / l)}};
}

double distance(const Point& a, const Point& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

// A hit on another primitive, or none, is right only where both are equally near or the ray passes an edge by a hair:
// then `tolerance` of all rays at most.
void check_against_double(const GeometryOnDevice& g, const std::vector<TestRay>& rays, double tolerance) {
  const auto hits = g.trace(rays);
  std::size_t met = 0, different = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const ExactHit exact = closest(g.geometry, rays[i]);
    met += exact.primitive >= 0;
    const int primitive = hits[i].primitive < 0 ? -1 : hits[i].primitive - static_cast<int>(g.record().first_primitive);
    if (primitive == exact.primitive) {
      if (primitive < 0) continue;
      const Point& o = rays[i].origin;
      const Point& d = rays[i].direction;
      const Point expected{o[0] + static_cast<float>(exact.t) * d[0], o[1] + static_cast<float>(exact.t) * d[1],
                           o[2] + static_cast<float>(exact.t) * d[2]};
      INFO("ray " << i << ", t " << hits[i].t << ", exact " << exact.t);
      REQUIRE(hits[i].t == Approx(exact.t).epsilon(1e-4).margin(2e-4));
      REQUIRE(distance(hits[i].position, expected) < 2e-4);
    } else {
      ++different;
    }
  }
  CHECK(met > rays.size() / 20);
  CHECK(static_cast<double>(different) <= tolerance * static_cast<double>(rays.size()));
}

std::size_t ray_count(std::size_t in_suite) {
  const char* given = std::getenv("ITN_RAYS");  // more, by hand
  return given ? static_cast<std::size_t>(std::atof(given)) : in_suite;
}

}  // namespace

TEST_CASE("host and device agree about the sizes of the geometry's records") {
  const GeometryOnDevice g(scene_of({shape_of(cube(1))}), 16, 16);
  CHECK(g.sizes() == std::array<int, 3>{sizeof(PrimitiveRecord), sizeof(GeometryRecord), sizeof(TestHit)});
}

TEST_CASE("random rays meet what a search in double finds, at all widths") {
  std::mt19937 random(1);
  std::vector<TestRay> rays(ray_count(20'000));
  for (auto& ray : rays) ray = {.origin = random_point(random, 1.5f), .direction = random_direction(random)};
  for (const int box_width : {4, 8, 16})
    check_against_double({scene_of({shape_of(torus_knot(512, 64))}), box_width == 4 ? 1 : box_width, box_width}, rays,
                         1e-5);
  check_against_double({scene_of({shape_of(spiky(3, 0.2f, 3)), shape_of(moved(cube(1), 0.5f, {0.7f, 0, 0}))}), 16, 16},
                       rays, 2e-4);
}

TEST_CASE("the search in double over the hierarchy finds what trying every triangle finds") {
  const Mesh mesh = torus_knot(64, 12);
  Geometry tree, flat;
  append_geometry(scene_of({shape_of(mesh)}), tree);
  std::mt19937 random(2);
  for (int i = 0; i < 1000; ++i) {
    const TestRay ray{.origin = random_point(random, 1.5f), .direction = random_direction(random)};
    ExactHit best;
    for (std::size_t k = 0; k < mesh.triangle.size(); ++k) {
      const auto& t = mesh.triangle[k];
      const double s = meet_triangle(ray, mesh.position[t[0]], mesh.position[t[1]], mesh.position[t[2]]);
      if (s >= 0 && s < best.t) best = {s, static_cast<int>(k)};
    }
    REQUIRE(closest(tree, ray).primitive == best.primitive);
  }
}

TEST_CASE("rays of paths inside a medium, from its surface too, meet what a search in double finds") {
  const GeometryOnDevice g(scene_of({shape_of(torus_knot(512, 64))}), 16, 16);
  // Within the tolerance of the flight's end a surface counts as met.
  check_against_double(g, g.paths({1, 0, 0}, 0.1, 0.9, ray_count(20'000), 3), 3e-4);
}

TEST_CASE("no ray from inside passes between triangles, however it is aimed") {
  struct Case {
    Mesh mesh;
    float inside;  // half size of a box within
  };
  for (const Case& c : {Case{cube(1), 0.99f}, Case{icosphere(3), 0.5f}, Case{spiky(2, 0.3f, 8), 0.02f}}) {
    const GeometryOnDevice g(scene_of({shape_of(c.mesh)}), 16, 16);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<TestRay> rays;
    std::vector<double> farthest;
    const auto aim = [&](const Point& origin, const Vec3& target) {
      rays.push_back(towards(origin, target));
      rays.back().inside = 1;
      farthest.push_back(std::hypot(target[0] - origin[0], target[1] - origin[1], target[2] - origin[2]) * (1 + 1e-5) +
                         1e-5);
    };
    for (int k = 0; k < 20'000; ++k) {
      const auto& t = c.mesh.triangle[random() % c.mesh.triangle.size()];
      const auto &p = c.mesh.position[t[0]], &q = c.mesh.position[t[1]];
      // Origins on coordinates of vertices make edge functions that are exactly zero.
      Point o = random_point(random, c.inside);
      for (std::size_t i = 0; i < 3; ++i)
        if (random() % 3 == 0) o[i] = std::clamp(p[i], -c.inside, c.inside);
      aim(o, {p[0], p[1], p[2]});
      const double s = unit(random);
      aim(o, {p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1]), p[2] + s * (q[2] - p[2])});
      // Along the axes and in coordinate planes, with zeros of both signs.
      Point d = random_direction(random);
      const std::size_t axis = random() % 3;
      d[axis] = random() % 2 ? 0.0f : -0.0f;
      if (random() % 2) d[(axis + 1) % 3] = random() % 2 ? 0.0f : -0.0f;
      rays.push_back({.origin = o, .direction = d, .inside = 1});
      farthest.push_back(INFINITY);
    }
    const auto hits = g.trace(rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      INFO("ray " << i);
      REQUIRE(hits[i].primitive >= 0);
      REQUIRE(hits[i].front == 0);
      REQUIRE(hits[i].t <= farthest[i] * std::hypot(1.0, 1e-6));
    }
  }
}

TEST_CASE("a ray in the plane of a face meets the closed mesh's other faces, not nothing") {
  const GeometryOnDevice g(scene_of({shape_of(cube(1))}), 16, 16);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-0.9f, 0.9f);
  std::vector<TestRay> rays;
  for (int k = 0; k < 1000; ++k)
    rays.push_back({.origin = {place(random), place(random), 1}, .direction = {1, 0, 0}, .inside = 1});
  for (const TestHit& hit : g.trace(rays)) REQUIRE(hit.primitive >= 0);
}

TEST_CASE("spheres and disks are met exactly, alone and among triangles") {
  std::mt19937 random(6);
  std::vector<Shape> shapes{sphere({0.5, -0.2, 0.1}, 0.4), disk({-0.6, 0, 0}, {0.3, 0.1, 0}, {0, 0.2, 0.5})};
  std::vector<TestRay> rays(20'000);
  for (auto& ray : rays) ray = {.origin = random_point(random, 1.2f), .direction = random_direction(random)};
  check_against_double({scene_of(shapes), 16, 16}, rays, 1e-4);
  for (int k = 0; k < 40; ++k) shapes.push_back(sphere({0.03 * k - 0.6, 0.02 * k, -0.8}, 0.01 + 0.002 * k));
  shapes.push_back(shape_of(moved(icosphere(2), 0.3f, {0, 0.7f, 0.3f})));
  for (const int box_width : {4, 16})
    check_against_double({scene_of(shapes), box_width == 4 ? 1 : 16, box_width}, rays, 1e-4);
}

TEST_CASE("a ray that starts on a sphere meets its far side only, and only inwards") {
  const GeometryOnDevice g(scene_of({sphere({3, -2, 1}, 0.5)}), 16, 16);
  std::mt19937 random(7);
  std::vector<TestRay> rays;
  std::vector<double> chord;
  for (int k = 0; k < 10'000; ++k) {
    const Point n = random_direction(random), d = random_direction(random);
    const double cosine = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
    rays.push_back({.origin = {3 + 0.5f * n[0], -2 + 0.5f * n[1], 1 + 0.5f * n[2]},
                    .direction = d,
                    .skip = 0,
                    .inside = cosine < 0});
    chord.push_back(-cosine);
  }
  const auto hits = g.trace(rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    REQUIRE((hits[i].primitive == 0) == (chord[i] > 0));
    if (chord[i] > 0) REQUIRE(hits[i].t == Approx(chord[i]).margin(5e-6));
  }
}

TEST_CASE("cylinders are met exactly, from outside and through their open ends, alone and among others") {
  std::mt19937 random(16);
  std::vector<Shape> shapes{cylinder({0.3, -0.4, -0.7}, {0.5, 0.1, 0.6}, 0.35)};
  std::vector<TestRay> rays(20'000);
  for (auto& ray : rays) ray = {.origin = random_point(random, 1.2f), .direction = random_direction(random)};
  check_against_double({scene_of(shapes), 16, 16}, rays, 1e-4);
  for (int k = 0; k < 40; ++k)
    shapes.push_back(cylinder({0.03 * k - 0.6, 0.02 * k, -0.8}, {0.02 * k - 0.4, 0.03 * k, -0.2}, 0.01 + 0.004 * k));
  shapes.push_back(sphere({-0.5, -0.2, 0.1}, 0.3));
  shapes.push_back(disk({-0.6, 0, 0}, {0.3, 0.1, 0}, {0, 0.2, 0.5}));
  shapes.push_back(shape_of(moved(icosphere(2), 0.3f, {0, 0.7f, 0.3f})));
  for (const int box_width : {4, 16})
    check_against_double({scene_of(shapes), box_width == 4 ? 1 : 16, box_width}, rays, 1e-4);
}

TEST_CASE("a ray that starts on a cylinder meets its far side between the ends only, and only inwards") {
  const GeometryOnDevice g(scene_of({cylinder({1, -2, 3}, {1, -2, 5}, 0.5)}), 16, 16);
  std::mt19937 random(17);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<TestRay> rays;
  std::vector<double> chord, end;
  for (int k = 0; k < 10'000; ++k) {
    const double angle = 6.28318530718 * unit(random), height = 2 * unit(random);
    const double x = std::cos(angle), y = std::sin(angle);
    const Point d = random_direction(random);
    const double inward = -(x * d[0] + y * d[1]), square = double{d[0]} * d[0] + double{d[1]} * d[1];
    rays.push_back(
        {.origin = {static_cast<float>(1 + 0.5 * x), static_cast<float>(-2 + 0.5 * y), static_cast<float>(3 + height)},
         .direction = d,
         .skip = 0});
    chord.push_back(inward / square);
    end.push_back(height + chord.back() * d[2]);
  }
  const auto hits = g.trace(rays);
  std::size_t met = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (std::abs(end[i]) < 1e-4 || std::abs(end[i] - 2) < 1e-4) continue;
    INFO("ray " << i << ", chord " << chord[i] << ", ends at " << end[i]);
    REQUIRE((hits[i].primitive == 0) == (chord[i] > 0 && end[i] > 0 && end[i] < 2));
    if (hits[i].primitive < 0) continue;
    ++met;
    REQUIRE(hits[i].t == Approx(chord[i]).margin(1e-5));
    REQUIRE(hits[i].front == 0);
  }
  CHECK(met > 3000);
}

TEST_CASE("rays from far away lose no accuracy in the test itself") {
  const GeometryOnDevice g(scene_of({shape_of(icosphere(4))}), 16, 16);
  std::mt19937 random(8);
  std::vector<TestRay> rays;
  for (int k = 0; k < 20'000; ++k) {
    const Point d = random_direction(random), target = random_point(random, 0.5f);
    rays.push_back(towards({-3000 * d[0], -3000 * d[1], -3000 * d[2]}, {target[0], target[1], target[2]}));
  }
  for (const TestHit& hit : g.trace(rays)) {
    REQUIRE(hit.primitive >= 0);
    REQUIRE(hit.front == 1);
    // On the facets between the sphere and the depth of their middles.
    const double r = distance(hit.position, {0, 0, 0});
    REQUIRE(r < 1 + 1e-6);
    REQUIRE(r > 0.995);
  }
}

TEST_CASE("a ray that is not finite meets nothing, and its search ends") {
  const int box_width = GENERATE(4, 8, 16);
  const GeometryOnDevice g(scene_of({shape_of(torus_knot(512, 64))}), box_width == 4 ? 1 : box_width, box_width);
  const float nan = std::nanf(""), infinity = INFINITY;
  std::vector<TestRay> rays;
  for (const float bad : {nan, infinity, -infinity})
    for (std::size_t axes = 1; axes < 64; ++axes) {
      TestRay ray{.origin = {0.1f, 0.2f, 0.3f}, .direction = {0.6f, 0.8f, 0}};
      for (std::size_t i = 0; i < 6; ++i)
        if (axes >> i & 1) (i < 3 ? ray.origin : ray.direction)[i % 3] = bad;
      rays.push_back(ray);
    }
  for (const auto& hit : g.trace(rays)) CHECK(hit.primitive < 0);
}

TEST_CASE("geometries that share arrays do not see each other") {
  const GeometryOnDevice g(
      std::vector<Scene>{scene_of({shape_of(cube(1)), sphere({0, 0, 0}, 2)}),
                         scene_of({shape_of(moved(icosphere(2), 1, {5, 0, 0})), sphere({0, 9, 0}, 1)})},
      16, 16);
  const auto first = static_cast<int>(g.record().first_primitive);
  CHECK(first == 13);
  const auto hits = g.trace({{.origin = {0, 0, 0}, .direction = {0, 0, 1}},
                             {.origin = {0, 0, 0.01f}, .direction = {1, 0, 0}},
                             {.origin = {0, 0, 0}, .direction = {0, 1, 0}}});
  CHECK(hits[0].primitive == -1);
  CHECK(hits[1].primitive >= first);
  CHECK(hits[1].t == Approx(4).margin(0.02));
  CHECK(hits[2].primitive == first + 320);
  CHECK(hits[2].t == Approx(8));
}

TEST_CASE("the hierarchy is the same whenever it is built") {
  const Scene scene = scene_of({shape_of(torus_knot(512, 64)), sphere({0, 0, 0}, 0.1)});
  Geometry a, b;
  append_geometry(scene, a);
  append_geometry(scene, b);
  CHECK(a.grid == b.grid);
  REQUIRE(a.nodes.size() == b.nodes.size());
  REQUIRE(a.leaves.size() == b.leaves.size());
  CHECK(std::memcmp(a.nodes.data(), b.nodes.data(), 4 * a.nodes.size()) == 0);
  CHECK(std::memcmp(a.leaves.data(), b.leaves.data(), 4 * a.leaves.size()) == 0);
}

TEST_CASE("an empty scene and flat, degenerate or tiny meshes are met or missed, never crash") {
  CHECK(GeometryOnDevice(scene_of({}), 16, 16).trace({{.origin = {0, 0, 0}, .direction = {0, 0, 1}}})[0].primitive ==
        -1);
  Mesh flat;
  flat.position = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}, {0, 0, 0}};
  flat.triangle = {{0, 1, 2}, {3, 3, 3}, {0, 0, 1}};
  const GeometryOnDevice g(scene_of({shape_of(flat)}), 16, 16);
  const auto hits =
      g.trace({{.origin = {0, 0, 1}, .direction = {0, 0, -1}}, {.origin = {2, 2, 1}, .direction = {0, 0, -1}}});
  CHECK(hits[0].primitive == 0);
  CHECK(hits[0].front == 1);
  CHECK(hits[1].primitive == -1);
  const GeometryOnDevice tiny(scene_of({shape_of(moved(cube(1), 1e-6f, {0, 0, 0}))}), 16, 16);
  CHECK(tiny.trace({{.origin = {0, 0, 1}, .direction = {0, 0, -1}}})[0].t == Approx(1));
}

TEST_CASE("normals and texture coordinates at hits are Mitsuba's") {
  Mesh smooth = icosphere(3);
  smooth.normal = smooth.position;
  Shape ball = sphere({4, 0, 0}, 0.5), round = disk({-4, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0});
  for (const int width : {1, 16}) {
    const GeometryOnDevice g(scene_of({shape_of(smooth), ball, round}), width, width == 1 ? 4 : 16);
    const auto frames = g.frames(g.trace({{.origin = {0.1f, 0.2f, 3}, .direction = {0, 0, -1}},
                                          {.origin = {4, 0.25f, 3}, .direction = {0, 0, -1}},
                                          {.origin = {-4, -0.25f, 3}, .direction = {0, 0, -1}}}));
    // Interpolated vertex normals of a sphere point from its centre.
    const double l = std::hypot(0.1, 0.2, std::sqrt(1 - 0.05));
    CHECK(frames[0].shading[0] == Approx(0.1 / l).margin(0.01));
    CHECK(frames[0].shading[1] == Approx(0.2 / l).margin(0.01));
    // phi = 90 degrees, theta = 30 degrees
    CHECK(frames[1].texture[0] == Approx(0.25));
    CHECK(frames[1].texture[1] == Approx(1.0 / 6));
    CHECK(frames[1].normal[1] == Approx(0.5));
    CHECK(frames[1].beside[2] > 0.5 * std::sqrt(0.75));
    // radius 1/2, phi = 270 degrees
    CHECK(frames[2].texture[0] == Approx(0.5));
    CHECK(frames[2].texture[1] == Approx(0.75));
    CHECK(frames[2].normal[2] == Approx(1));
    CHECK(frames[2].beside[2] > 0);
  }
}

TEST_CASE("normals and texture coordinates on a cylinder are Mitsuba 3.9.1's") {
  Shape turned = cylinder({0, 1, 0}, {1, 2, 3}, 0.5);
  for (const bool flip : {false, true}) {
    turned.flip_normals = flip;
    for (const int width : {1, 16}) {
      const GeometryOnDevice g(scene_of({turned}), width, width == 1 ? 4 : 16);
      const auto hits = g.trace({{.origin = {5, 1.5f, 1}, .direction = {-1, 0, 0}}});
      REQUIRE(hits[0].primitive == 0);
      CHECK(hits[0].t == Approx(4.152506));
      const auto frame = g.frames(hits)[0];
      const double expected[3] = {0.9045, 0.2095, -0.3714};
      for (std::size_t k = 0; k < 3; ++k) {
        CHECK(frame.normal[k] == Approx((flip ? -1 : 1) * expected[k]).margin(1e-4));
        CHECK(frame.shading[k] == frame.normal[k]);
      }
      CHECK(frame.texture[0] == Approx(0.04324).margin(1e-5));
      CHECK(frame.texture[1] == Approx(0.39523).margin(1e-5));
    }
  }
}
