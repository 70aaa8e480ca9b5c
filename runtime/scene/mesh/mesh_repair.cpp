#include "runtime/scene/mesh/mesh_repair.h"

#include <algorithm>
#include <cmath>

#include "runtime/scene/box.h"
#include "runtime/scene/mesh/mesh_topology.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

Vec3 to_double(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

// Angle between unit vectors, exact also near 0 and pi.
double angle_between(const Vec3& a, const Vec3& b) {
  return dot(a, b) < 0 ? M_PI - 2 * std::asin(std::min(1.0, length(a + b) / 2))
                       : 2 * std::asin(std::min(1.0, length(b - a) / 2));
}

}  // namespace

void compute_normals(Mesh& mesh) {
  std::vector<Vec3> sum(mesh.position.size(), Vec3{0, 0, 0});
  for (const auto& t : mesh.triangle) {
    const Vec3 corner[3] = {to_double(mesh.position[t[0]]), to_double(mesh.position[t[1]]),
                            to_double(mesh.position[t[2]])};
    const Vec3 normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    if (!(length(normal) > 0)) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 a = normalize(corner[(i + 1) % 3] - corner[i]), b = normalize(corner[(i + 2) % 3] - corner[i]);
      sum[t[i]] = sum[t[i]] + (angle_between(a, b) / length(normal)) * normal;
    }
  }
  mesh.normal.resize(sum.size());
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const double size = length(sum[i]);
    const Vec3 n = size > 0 ? (1 / size) * sum[i] : Vec3{1, 0, 0};
    mesh.normal[i] = {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])};
  }
}

void flip(Mesh& mesh) {
  for (auto& t : mesh.triangle) std::swap(t[1], t[2]);
  for (auto& n : mesh.normal) n = {-n[0], -n[1], -n[2]};
}

void erase_triangles(Mesh& mesh, const std::vector<bool>& marked) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < marked.size(); ++i) {
    if (marked[i]) continue;
    mesh.triangle[kept] = mesh.triangle[i];
    for (MeshAttribute& a : mesh.attributes)
      if (a.is_of_faces())
        for (std::size_t c = 0; c < a.channels; ++c) a.values[kept * a.channels + c] = a.values[i * a.channels + c];
    ++kept;
  }
  mesh.triangle.resize(kept);
  for (MeshAttribute& a : mesh.attributes)
    if (a.is_of_faces()) a.values.resize(kept * a.channels);
}

void add_triangle(Mesh& mesh, const std::array<std::uint32_t, 3>& triangle, std::size_t like) {
  mesh.triangle.push_back(triangle);
  for (MeshAttribute& a : mesh.attributes)
    if (a.is_of_faces())
      for (std::size_t c = 0; c < a.channels; ++c) a.values.push_back(a.values[like * a.channels + c]);
}

std::size_t drop_degenerate(Mesh& mesh) {
  std::vector<bool> flat;
  flat.reserve(mesh.triangle.size());
  for (const auto& t : mesh.triangle) flat.push_back(!(length(area_normal(mesh, t)) > 0));
  const auto dropped = static_cast<std::size_t>(std::count(flat.begin(), flat.end(), true));
  if (dropped > 0) erase_triangles(mesh, flat);
  return dropped;
}

void drop_unused_vertices(Mesh& mesh) {
  std::vector<std::uint32_t> index(mesh.position.size(), 0);  // 1: used; then where the vertex goes
  for (const auto& t : mesh.triangle)
    for (const std::uint32_t corner : t) index[corner] = 1;
  std::uint32_t kept = 0;
  for (std::size_t i = 0; i < index.size(); ++i) {
    if (index[i] == 0) continue;
    mesh.position[kept] = mesh.position[i];
    if (!mesh.normal.empty()) mesh.normal[kept] = mesh.normal[i];
    if (!mesh.texcoord.empty()) mesh.texcoord[kept] = mesh.texcoord[i];
    for (MeshAttribute& a : mesh.attributes)
      if (!a.is_of_faces())
        for (std::size_t c = 0; c < a.channels; ++c) a.values[kept * a.channels + c] = a.values[i * a.channels + c];
    index[i] = kept++;
  }
  if (kept == mesh.position.size()) return;
  mesh.position.resize(kept);
  if (!mesh.normal.empty()) mesh.normal.resize(kept);
  if (!mesh.texcoord.empty()) mesh.texcoord.resize(kept);
  for (MeshAttribute& a : mesh.attributes)
    if (!a.is_of_faces()) a.values.resize(kept * a.channels);
  for (auto& t : mesh.triangle)
    for (std::uint32_t& corner : t) corner = index[corner];
}

void set_on_floor(Mesh& mesh) {
  const Box box = box_of(mesh);
  const Vec3 low = to_double(box.low), high = to_double(box.high);
  const double scale = 1 / std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  const Vec3 foot{(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]};
  for (auto& p : mesh.position)
    for (std::size_t k = 0; k < 3; ++k) p[k] = static_cast<float>((p[k] - foot[k]) * scale);
}

}  // namespace itn
