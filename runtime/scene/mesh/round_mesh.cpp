#include "runtime/scene/mesh/round_mesh.h"

#include <cmath>
#include <numbers>

#include "runtime/scene/mesh/mesh_repair.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

using std::numbers::pi;

// Two triangles between each pair of neighbours in a grid of rows and columns; of those that would have no area none.
void add_strips(std::uint32_t rows, std::uint32_t columns, bool has_poles, Mesh& mesh) {
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column) {
      const std::uint32_t a = row * (columns + 1) + column, b = a + 1, c = a + columns + 1, d = c + 1;
      if (!has_poles || row > 0) mesh.triangle.push_back({a, c, b});
      if (!has_poles || row + 1 < rows) mesh.triangle.push_back({b, c, d});
    }
}

double volume_of(const Mesh& mesh) {
  double sum = 0;
  const auto at = [&](std::uint32_t i) { return Vec3{mesh.position[i][0], mesh.position[i][1], mesh.position[i][2]}; };
  for (const auto& t : mesh.triangle) sum += dot(at(t[0]), cross(at(t[1]), at(t[2]))) / 6;
  return sum;
}

// Sphere of radius 1 around the origin, in coordinates along the shape's axes.
Mesh unit_sphere(int turn) {
  Mesh mesh;
  const int rows = turn / 2;
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column <= turn; ++column) {
      // The last column is the first once more, to the bit: a closed surface.
      const double theta = pi * row / rows, phi = 2 * pi * (column % turn) / turn;
      const double across = row % rows == 0 ? 0 : std::sin(theta);
      mesh.position.push_back(to_float({across * std::cos(phi), across * std::sin(phi), std::cos(theta)}));
      mesh.texcoord.push_back(
          {static_cast<float>(column) / static_cast<float>(turn), static_cast<float>(row) / static_cast<float>(rows)});
    }
  add_strips(static_cast<std::uint32_t>(rows), static_cast<std::uint32_t>(turn), true, mesh);
  mesh.normal = mesh.position;
  const double grown = std::cbrt(4 * pi / 3 / volume_of(mesh));
  for (auto& p : mesh.position)
    for (float& x : p) x = static_cast<float>(grown * static_cast<double>(x));
  return mesh;
}

Mesh unit_cylinder(int turn) {
  Mesh mesh;
  const double grown = std::sqrt(2 * pi / (turn * std::sin(2 * pi / turn)));
  for (int row = 0; row <= 1; ++row)
    for (int column = 0; column <= turn; ++column) {
      const double phi = 2 * pi * (column % turn) / turn, x = std::cos(phi), y = std::sin(phi);
      mesh.position.push_back(to_float({grown * x, grown * y, 1.0 - row}));
      mesh.normal.push_back(to_float({x, y, 0}));
      mesh.texcoord.push_back({static_cast<float>(column) / static_cast<float>(turn), 1 - static_cast<float>(row)});
    }
  add_strips(1, static_cast<std::uint32_t>(turn), false, mesh);
  return mesh;
}

}  // namespace

PlacedMesh round_mesh(const Shape& shape, int turn) {
  const bool is_sphere = shape.kind == Shape::Kind::sphere;
  PlacedMesh mesh{is_sphere ? unit_sphere(turn) : unit_cylinder(turn), shape.center};
  const auto along = [&](const Vec3& axis) { return is_sphere ? shape.radius * normalize(axis) : axis; };
  const Vec3 u = along(shape.edge_u), v = along(shape.edge_v), w = along(shape.axis);
  const auto place = [&](const std::array<float, 3>& p) {
    return static_cast<double>(p[0]) * u + static_cast<double>(p[1]) * v + static_cast<double>(p[2]) * w;
  };
  for (auto& p : mesh.position) p = to_float(place(p));
  for (auto& n : mesh.normal) n = to_float(normalize(place(n)));
  if (dot(cross(u, v), w) < 0)
    for (auto& t : mesh.triangle) std::swap(t[1], t[2]);
  if (shape.flip_normals) flip(mesh);
  return mesh;
}

}  // namespace itn
