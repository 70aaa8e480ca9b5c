#include "tests/support/meshes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "runtime/scene/transform.h"

namespace itn::test {

namespace {

constexpr double pi = std::numbers::pi;

std::array<float, 3> point(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

std::array<float, 3> unit(std::array<float, 3> p) {
  const double l = std::sqrt(double{p[0]} * p[0] + double{p[1]} * p[1] + double{p[2]} * p[2]);
  return point(p[0] / l, p[1] / l, p[2] / l);
}

}  // namespace

Mesh torus_knot(int segments, int sides) {
  // (2, 3) torus knot around z, tube radius 0.24
  const auto curve = [](double t) -> Vec3 {
    const double r = 0.7 + 0.3 * std::cos(3 * t);
    return {r * std::cos(2 * t), r * std::sin(2 * t), 0.3 * std::sin(3 * t)};
  };
  Mesh mesh;
  for (int i = 0; i < segments; ++i) {
    const double t = 2 * pi * i / segments, h = 1e-4;
    const Vec3 c = curve(t), a = curve(t - h), b = curve(t + h);
    Vec3 tangent{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double l = std::hypot(tangent[0], tangent[1], tangent[2]);
    for (double& x : tangent) x /= l;
    // The direction from the axis, made perpendicular to the tangent.
    const double along = c[0] * tangent[0] + c[1] * tangent[1];
    Vec3 u{c[0] - along * tangent[0], c[1] - along * tangent[1], -along * tangent[2]};
    const double m = std::hypot(u[0], u[1], u[2]);
    for (double& x : u) x /= m;
    const Vec3 v{tangent[1] * u[2] - tangent[2] * u[1], tangent[2] * u[0] - tangent[0] * u[2],
                 tangent[0] * u[1] - tangent[1] * u[0]};
    for (int j = 0; j < sides; ++j) {
      const double p = 2 * pi * j / sides, x = 0.18 * std::cos(p), y = 0.18 * std::sin(p);
      mesh.position.push_back(
          point(c[0] + x * u[0] + y * v[0], c[1] + x * u[1] + y * v[1], c[2] + x * u[2] + y * v[2]));
    }
  }
  for (int i = 0; i < segments; ++i)
    for (int j = 0; j < sides; ++j) {
      const auto at = [&](int a, int b) {
        return static_cast<std::uint32_t>((i + a) % segments * sides + (j + b) % sides);
      };
      mesh.triangle.push_back({at(0, 0), at(0, 1), at(1, 0)});
      mesh.triangle.push_back({at(1, 0), at(0, 1), at(1, 1)});
    }
  return mesh;
}

Mesh cube(float half) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.position.push_back({i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half});
  mesh.triangle = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

Mesh icosphere(int subdivisions) {
  const float g = static_cast<float>(std::numbers::phi);
  Mesh mesh;
  mesh.position = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangle = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                   {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                   {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int s = 0; s < subdivisions; ++s) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, fresh] = middles.try_emplace(std::pair(std::min(a, b), std::max(a, b)),
                                                      static_cast<std::uint32_t>(mesh.position.size()));
      if (fresh) {
        const auto &p = mesh.position[a], &q = mesh.position[b];
        mesh.position.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
      }
      return entry->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& t : mesh.triangle) {
      const std::uint32_t a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
      for (const auto& part : {std::array{t[0], a, c}, {a, t[1], b}, {c, b, t[2]}, {a, b, c}}) finer.push_back(part);
    }
    mesh.triangle = std::move(finer);
  }
  for (auto& p : mesh.position) p = unit(p);
  return mesh;
}

Mesh spiky(int subdivisions, float shortest, unsigned seed) {
  Mesh mesh = icosphere(subdivisions);
  std::mt19937 random(seed);
  for (auto& p : mesh.position) {
    const double r = shortest + (1 - shortest) * std::pow(static_cast<double>(random()) / 0x1p32, 3);
    p = point(p[0] * r, p[1] * r, p[2] * r);
  }
  return mesh;
}

Mesh star_plate(int points, float thickness) {
  Mesh mesh;
  mesh.position = {{0, 0, thickness}, {0, 0, -thickness}};
  const int n = 2 * points;
  for (int i = 0; i < n; ++i) {
    const double a = 2 * pi * i / n, r = i % 2 ? 0.3 : 1;
    mesh.position.push_back(point(r * std::cos(a), r * std::sin(a), 0));
  }
  for (int i = 0; i < n; ++i) {
    const auto a = static_cast<std::uint32_t>(2 + i), b = static_cast<std::uint32_t>(2 + (i + 1) % n);
    mesh.triangle.push_back({0, a, b});
    mesh.triangle.push_back({1, b, a});
  }
  return mesh;
}

Mesh moved(Mesh mesh, float scale, std::array<float, 3> translation) {
  for (auto& p : mesh.position)
    for (std::size_t k = 0; k < 3; ++k) p[k] = p[k] * scale + translation[k];
  return mesh;
}

Shape shape_of(Mesh mesh) {
  Shape shape;
  shape.mesh = std::make_shared<const Mesh>(std::move(mesh));
  shape.bsdf = 0;
  shape.interior = 0;
  return shape;
}

Shape sphere(Vec3 center, double radius) {
  Shape shape;
  shape.kind = Shape::Kind::sphere;
  shape.center = center;
  shape.radius = radius;
  shape.bsdf = 0;
  shape.interior = 0;
  return shape;
}

Shape disk(Vec3 center, Vec3 edge_u, Vec3 edge_v) {
  Shape shape;
  shape.kind = Shape::Kind::disk;
  shape.center = center;
  shape.edge_u = edge_u;
  shape.edge_v = edge_v;
  shape.bsdf = 0;
  return shape;
}

Shape cylinder(Vec3 p0, Vec3 p1, double radius) {
  Shape shape;
  shape.kind = Shape::Kind::cylinder;
  shape.center = p0;
  shape.radius = radius;
  shape.axis = p1 - p0;
  const Vec3 along = normalize(shape.axis), across = some_perpendicular(along);
  shape.edge_u = radius * across;
  shape.edge_v = radius * cross(along, across);
  shape.bsdf = 0;
  return shape;
}

}  // namespace itn::test
