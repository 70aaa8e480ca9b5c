// The scene in double precision: what the stages should compute.
#pragma once
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "itn/scene.h"

namespace itn::test {

constexpr double pi = std::numbers::pi;

inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec3 along(const Vec3& o, double t, const Vec3& d) {
  return {o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]};
}
inline Vec3 difference(const Vec3& a, const Vec3& b) { return along(a, -1, b); }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Vec3& a) { return std::sqrt(dot(a, a)); }
inline double distance(const Vec3& a, const Vec3& b) { return length(difference(a, b)); }
inline Vec3 unit(const Vec3& a) { return along({0, 0, 0}, 1 / length(a), a); }

class Rays {
 public:
  explicit Rays(unsigned seed) : generator_(seed) {}
  double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator_); }
  Vec3 direction() {
    std::normal_distribution<double> normal;
    return unit({normal(generator_), normal(generator_), normal(generator_)});
  }

 private:
  std::mt19937 generator_;
};

struct HostHit {
  int shape = -1;  // -1: none
  double t = std::numeric_limits<double>::infinity();
  Vec3 normal{};  // unit, outward
};

// Closest surface beyond t_min, by trying all of them.
inline HostHit closest(const Scene& scene, const Vec3& o, const Vec3& d, double t_min) {
  HostHit hit;
  const auto offer = [&](std::size_t shape, double t, const Vec3& normal) {
    if (t > t_min && t < hit.t) hit = {static_cast<int>(shape), t, normal};
  };
  for (std::size_t s = 0; s < scene.shapes.size(); ++s) {
    const Shape& shape = scene.shapes[s];
    if (shape.kind == Shape::Kind::sphere) {
      const Vec3 from = difference(o, shape.center);
      const double b = dot(from, d), c = dot(from, from) - shape.radius * shape.radius, root = b * b - c;
      if (root < 0) continue;
      for (const double t : {-b - std::sqrt(root), -b + std::sqrt(root)})
        offer(s, t, unit(difference(along(o, t, d), shape.center)));
    } else if (shape.kind == Shape::Kind::mesh) {
      for (const auto& triangle : shape.mesh->triangle) {
        Vec3 v[3];
        for (std::size_t k = 0; k < 3; ++k)
          for (std::size_t x = 0; x < 3; ++x) v[k][x] = static_cast<double>(shape.mesh->position[triangle[k]][x]);
        const Vec3 e1 = difference(v[1], v[0]), e2 = difference(v[2], v[0]), p = cross(d, e2),
                   from = difference(o, v[0]), q = cross(from, e1);
        const double determinant = dot(e1, p);
        if (determinant == 0) continue;
        const double a = dot(from, p) / determinant, b = dot(d, q) / determinant;
        if (a >= 0 && b >= 0 && a + b <= 1) offer(s, dot(e2, q) / determinant, unit(cross(e1, e2)));
      }
    }
  }
  return hit;
}

}  // namespace itn::test
