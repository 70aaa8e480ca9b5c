#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "tests/geometry/geometry_device.h"

using namespace itn;
using namespace itn::test;

namespace {

Vec3 sub(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vec3 wide(const std::array<float, 3>& p) { return {p[0], p[1], p[2]}; }

// Moeller-Trumbore in double: distance, or infinity.
double meet(const TestRay& ray, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 d = wide(ray.direction), e1 = sub(b, a), e2 = sub(c, a), p = cross(d, e2), s = sub(wide(ray.origin), a);
  const double det = dot(e1, p), u = dot(s, p) / det, v = dot(d, cross(s, e1)) / det, t = dot(e2, cross(s, e1)) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && t > 0 ? t : INFINITY;
}

struct Closest {
  double t = INFINITY;
  int primitive = -1;
};

Closest closest(const TestRay& ray, const Mesh& mesh) {
  Closest best;
  for (std::size_t i = 0; i < mesh.triangle.size(); ++i) {
    const auto& f = mesh.triangle[i];
    const double t = meet(ray, wide(mesh.position[f[0]]), wide(mesh.position[f[1]]), wide(mesh.position[f[2]]));
    if (t < best.t) best = {t, static_cast<int>(i)};
  }
  return best;
}

std::array<float, 3> random_direction(std::mt19937& random) {
  std::normal_distribution<float> normal;
  const float x = normal(random), y = normal(random), z = normal(random), l = std::sqrt(x * x + y * y + z * z);
  return {x / l, y / l, z / l};
}

}  // namespace

TEST_CASE("host and device agree about the sizes of the geometry's records") {
  const GeometryOnDevice g(scene_of({shape_of(cube(1))}), 16, 16);
  CHECK(g.sizes() == std::array<int, 3>{sizeof(PrimitiveRecord), sizeof(GeometryRecord), sizeof(TestHit)});
}

TEST_CASE("random rays meet the triangle that brute force in double finds") {
  const Mesh mesh = torus_knot(96, 12);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-1.5f, 1.5f);
  std::vector<TestRay> rays(5000);
  for (auto& ray : rays) {
    ray.origin = {place(random), place(random), place(random)};
    ray.direction = random_direction(random);
  }
  for (const int box_width : {4, 8, 16}) {
    const GeometryOnDevice g(scene_of({shape_of(mesh)}), box_width == 4 ? 1 : box_width, box_width);
    const auto hits = g.trace(rays);
    int met = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Closest expected = closest(rays[i], mesh);
      met += expected.primitive >= 0;
      REQUIRE(hits[i].primitive == expected.primitive);
      if (expected.primitive >= 0) REQUIRE(hits[i].t == Approx(expected.t).epsilon(1e-4).margin(1e-5));
    }
    CHECK(met > 500);
  }
}
