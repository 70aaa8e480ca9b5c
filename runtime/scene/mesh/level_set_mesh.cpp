#include "runtime/scene/mesh/level_set_mesh.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "itn/error.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

constexpr std::size_t most_points = 16'000'000;  // of the finer lattice, but where the grid alone has more
// Triangles that the finer lattice may make, and the grid's own: 500 bytes each while their hierarchy is built. A cube
// that the surface goes through has so many, about.
constexpr double many_triangles = 4e6, most_triangles = 8e6, triangles_a_cube = 7;

class Interpolation {
 public:
  explicit Interpolation(const LevelSet& field) : field_(field) {}

  // place: in cells from the cube's corner
  double value(const Vec3& place) const {
    const auto cell = cell_of(place);
    double sum = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      std::array<std::size_t, 3> at{};
      double weight = 1;
      for (std::size_t k = 0; k < 3; ++k) {
        const bool upper = (i >> k) & 1;
        const double share = place[k] - static_cast<double>(cell[k]);
        at[k] = cell[k] + (upper ? 1 : 0);
        weight *= upper ? share : 1 - share;
      }
      sum += weight * field_.value[(at[2] * field_.size[1] + at[1]) * field_.size[0] + at[0]];
    }
    return sum;
  }
  // By positions in the cube.
  Vec3 analytic_gradient(const Vec3& place) const {
    const auto cell = cell_of(place);
    return {slope(0, cell[0], place), slope(1, cell[1], place), slope(2, cell[2], place)};
  }
  Vec3 smooth_normal(const Vec3& place) const {
    std::array<std::array<double, 2>, 3> weight{}, slopes{};  // of the two cells along each axis around the place
    for (std::size_t k = 0; k < 3; ++k) {
      const double from_middle = place[k] - 0.5, low = std::floor(from_middle);
      for (std::size_t upper = 0; upper < 2; ++upper) {
        const double cell = std::clamp(low + static_cast<double>(upper), 0.0, cells(k) - 1);
        weight[k][upper] = upper ? from_middle - low : 1 - (from_middle - low);
        slopes[k][upper] = slope(k, static_cast<std::size_t>(cell), place);
      }
    }
    Vec3 sum{0, 0, 0};
    for (std::size_t i = 0; i < 8; ++i) {  // the cells whose middles surround the place
      const std::size_t x = i & 1, y = (i >> 1) & 1, z = i >> 2;
      const Vec3 gradient{slopes[0][x], slopes[1][y], slopes[2][z]};
      if (length(gradient) > 0) sum = sum + weight[0][x] * weight[1][y] * weight[2][z] * normalize(gradient);
    }
    return sum;
  }
  double cells(std::size_t axis) const { return static_cast<double>(field_.size[axis] - 1); }

 private:
  std::array<std::size_t, 3> cell_of(const Vec3& place) const {
    std::array<std::size_t, 3> cell{};
    for (std::size_t k = 0; k < 3; ++k)
      cell[k] = static_cast<std::size_t>(std::clamp(std::floor(place[k]), 0.0, cells(k) - 1));
    return cell;
  }

  // Change of the field along an axis, from one side of a cell of that axis to the other, at the place's other
  // coordinates.
  double slope(std::size_t axis, std::size_t cell, const Vec3& place) const {
    Vec3 low = place, high = place;
    low[axis] = static_cast<double>(cell);
    high[axis] = low[axis] + 1;
    return (value(high) - value(low)) * cells(axis);
  }

  const LevelSet& field_;
};

class Polygons {
 public:
  Polygons(const LevelSet& field, LevelSetNormals normals) : interpolation_(field), normals_(normals) {
    std::size_t corners = 1;
    for (const std::size_t n : field.size) corners *= n;
    steps_ = std::clamp(std::cbrt(static_cast<double>(most_points) / static_cast<double>(corners)), 1.0, 3.0);
    steps_ = std::floor(steps_);
    const double cubes = triangles_a_cube * static_cast<double>(cut_cells(field));
    while (steps_ > 1 && cubes * steps_ * steps_ > many_triangles) --steps_;
    if (cubes > most_triangles)
      throw InputError(fmt::format(
          "the surface goes through {} of the {} cells between values, which makes about {:.2g} "
          "triangles; need at most {:.2g}: smooth the values, or resample the grid",
          cut_cells(field), (field.size[0] - 1) * (field.size[1] - 1) * (field.size[2] - 1), cubes, most_triangles));
    for (std::size_t k = 0; k < 3; ++k) points_[k] = (field.size[k] - 1) * static_cast<std::size_t>(steps_) + 1;
    values_.resize(points_[0] * points_[1] * points_[2]);
    for (std::size_t i = 0; i < values_.size(); ++i) values_[i] = interpolation_.value(place_of(i));
  }

  Mesh mesh() {
    // A cube is six tetrahedra around its diagonal from corner 0 to corner 7; corner i is at x = i & 1, y = i >> 1 & 1,
    // z = i >> 2.
    constexpr std::size_t around[7] = {1, 3, 2, 6, 4, 5, 1};
    for (std::size_t z = 0; z + 1 < points_[2]; ++z)
      for (std::size_t y = 0; y + 1 < points_[1]; ++y)
        for (std::size_t x = 0; x + 1 < points_[0]; ++x) {
          std::array<std::size_t, 8> corner{};
          int inside = 0;
          for (std::size_t i = 0; i < 8; ++i) {
            corner[i] = ((z + (i >> 2)) * points_[1] + y + ((i >> 1) & 1)) * points_[0] + x + (i & 1);
            inside += is_inside(corner[i]) ? 1 : 0;
          }
          if (inside == 0 || inside == 8) continue;
          for (std::size_t t = 0; t < 6; ++t)
            add_tetrahedron({corner[0], corner[around[t]], corner[around[t + 1]], corner[7]});
        }
    return std::move(mesh_);
  }

 private:
  bool is_inside(std::size_t point) const { return values_[point] < 0; }

  // Through how many of the grid's cells the surface goes.
  static std::size_t cut_cells(const LevelSet& field) {
    const auto is_below = [&](std::size_t x, std::size_t y, std::size_t z) {
      return field.value[(z * field.size[1] + y) * field.size[0] + x] < 0;
    };
    std::size_t cut = 0;
    for (std::size_t z = 0; z + 1 < field.size[2]; ++z)
      for (std::size_t y = 0; y + 1 < field.size[1]; ++y)
        for (std::size_t x = 0; x + 1 < field.size[0]; ++x) {
          int below = 0;
          for (std::size_t i = 0; i < 8; ++i) below += is_below(x + (i & 1), y + ((i >> 1) & 1), z + (i >> 2)) ? 1 : 0;
          cut += below != 0 && below != 8 ? 1 : 0;
        }
    return cut;
  }

  // In cells.
  Vec3 place_of(std::size_t point) const {
    const std::size_t x = point % points_[0], y = point / points_[0] % points_[1], z = point / points_[0] / points_[1];
    return {static_cast<double>(x) / steps_, static_cast<double>(y) / steps_, static_cast<double>(z) / steps_};
  }

  Vec3 in_cube(const Vec3& place) const {
    return {place[0] / interpolation_.cells(0), place[1] / interpolation_.cells(1), place[2] / interpolation_.cells(2)};
  }

  // Index of the vertex on the edge between a point inside and one outside.
  std::uint32_t vertex(std::size_t inside, std::size_t outside) {
    const auto [known, is_new] = vertices_.try_emplace(
        std::min(inside, outside) * values_.size() + std::max(inside, outside), mesh_.position.size());
    if (!is_new) return static_cast<std::uint32_t>(known->second);
    const double a = values_[inside], b = values_[outside];
    const double t = a / (a - b);
    const Vec3 place = (1 - t) * place_of(inside) + t * place_of(outside);
    Vec3 normal = normals_ == LevelSetNormals::smooth ? interpolation_.smooth_normal(place)
                                                      : interpolation_.analytic_gradient(place);
    if (!(length(normal) > 0)) normal = in_cube(place_of(outside)) - in_cube(place_of(inside));
    normal = normalize(normal);
    const Vec3 p = in_cube(place);
    mesh_.position.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    mesh_.normal.push_back(
        {static_cast<float>(normal[0]), static_cast<float>(normal[1]), static_cast<float>(normal[2])});
    return static_cast<std::uint32_t>(known->second);
  }

  // outwards: from a point inside to one outside
  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, const Vec3& outwards) {
    const auto at = [&](std::uint32_t i) {
      const auto& p = mesh_.position[i];
      return Vec3{p[0], p[1], p[2]};
    };
    if (dot(cross(at(b) - at(a), at(c) - at(a)), outwards) < 0) std::swap(b, c);
    mesh_.triangle.push_back({a, b, c});
  }

  void add_tetrahedron(const std::array<std::size_t, 4>& corner) {
    std::vector<std::size_t> in, out;
    for (const std::size_t c : corner) (is_inside(c) ? in : out).push_back(c);
    if (in.empty() || out.empty()) return;
    Vec3 outwards{0, 0, 0};
    for (const std::size_t c : out)
      outwards = outwards + (1.0 / static_cast<double>(out.size())) * in_cube(place_of(c));
    for (const std::size_t c : in) outwards = outwards - (1.0 / static_cast<double>(in.size())) * in_cube(place_of(c));
    if (in.size() == 2) {
      const std::uint32_t a = vertex(in[0], out[0]), b = vertex(in[0], out[1]), c = vertex(in[1], out[1]),
                          d = vertex(in[1], out[0]);
      add_triangle(a, b, c, outwards);
      add_triangle(a, c, d, outwards);
    } else if (in.size() == 1) {
      add_triangle(vertex(in[0], out[0]), vertex(in[0], out[1]), vertex(in[0], out[2]), outwards);
    } else {
      add_triangle(vertex(in[0], out[0]), vertex(in[1], out[0]), vertex(in[2], out[0]), outwards);
    }
  }

  Interpolation interpolation_;
  LevelSetNormals normals_;
  double steps_ = 1;                                       // of the lattice in a cell
  std::array<std::size_t, 3> points_{};                    // of the lattice
  std::vector<double> values_;                             // there
  std::unordered_map<std::size_t, std::size_t> vertices_;  // by edge
  Mesh mesh_;
};

}  // namespace

Mesh level_set_mesh(const LevelSet& field, LevelSetNormals normals) { return Polygons(field, normals).mesh(); }

}  // namespace itn
