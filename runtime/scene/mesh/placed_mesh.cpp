#include "runtime/scene/mesh/placed_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "runtime/scene/transform.h"

namespace itn {

std::array<float, 3> to_float(const Vec3& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

Extent Extent::empty() {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  return {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
}

void Extent::add(const Vec3& point) {
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], point[k]);
    high[k] = std::max(high[k], point[k]);
  }
}

double Extent::longest_side() const { return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}); }

double Extent::farthest_from(const Vec3& p) const {
  double most = 0;
  for (std::size_t k = 0; k < 3; ++k) most = std::max({most, std::abs(low[k] - p[k]), std::abs(high[k] - p[k])});
  return most;
}

Vec3 own_origin(const Extent& box) {
  const double size = box.longest_side();
  if (!(size > 0) || !(box.farthest_from({}) > far_away * size)) return {};
  return rounded_middle(0.5 * (box.low + box.high), size);
}

Vec3 rounded_middle(const Vec3& middle, double size) {
  const double step = std::exp2(std::floor(std::log2(size)));
  Vec3 result{};
  for (std::size_t k = 0; k < 3; ++k) result[k] = std::round(middle[k] / step) * step;
  return result;
}

void set_positions(PlacedMesh& mesh, const std::vector<Vec3>& positions, FilePrecision precision) {
  Extent box = Extent::empty();
  for (const Vec3& p : positions) box.add(p);
  const double size = box.longest_side();
  mesh.rounding = precision == FilePrecision::single && size > 0 ? 0x1p-24 * box.farthest_from({}) / size : 0;
  mesh.origin = own_origin(box);
  mesh.position.clear();
  mesh.position.reserve(positions.size());
  for (const Vec3& p : positions) mesh.position.push_back(to_float(p - mesh.origin));
}

void transform_mesh(const Transform& transform, PlacedMesh& mesh, bool keeps_outside) {
  if (keeps_outside && determinant(transform) < 0)
    for (auto& t : mesh.triangle) std::swap(t[1], t[2]);
  const auto place = [&](const std::array<float, 3>& p) {
    return transform_point(transform, Vec3{p[0], p[1], p[2]} + mesh.origin);
  };
  Extent box = Extent::empty();
  for (const auto& p : mesh.position) box.add(place(p));
  const Vec3 origin = own_origin(box);
  for (auto& p : mesh.position) p = to_float(place(p) - origin);
  mesh.origin = origin;
  const Transform for_normals = inverse_transpose(transform);
  for (auto& n : mesh.normal) {
    const Vec3 turned = transform_vector(for_normals, {n[0], n[1], n[2]});
    if (length(turned) > 0) n = to_float(normalize(turned));
  }
}

}  // namespace itn
