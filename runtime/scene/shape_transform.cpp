#include "runtime/scene/shape_transform.h"

#include <algorithm>
#include <cmath>

#include "runtime/scene/transform.h"

namespace itn {
namespace {

std::array<float, 3> to_float(const Vec3& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

// Are they at right angles, in single precision's measure?
bool perpendicular(const Vec3& a, const Vec3& b) { return std::abs(dot(a, b)) <= 1e-4 * length(a) * length(b); }
bool equal_lengths(const Vec3& a, const Vec3& b) {
  return std::abs(dot(a, a) - dot(b, b)) <= 1e-4 * std::max(dot(a, a), dot(b, b));
}

}  // namespace

void transform_mesh(const Transform& transform, Mesh& mesh, bool keeps_outside) {
  if (keeps_outside && determinant(transform) < 0)
    for (auto& t : mesh.triangle) std::swap(t[1], t[2]);
  const Transform for_normals = inverse_transpose(transform);
  for (auto& p : mesh.position) p = to_float(transform_point(transform, {p[0], p[1], p[2]}));
  for (auto& n : mesh.normal) {
    const Vec3 turned = transform_vector(for_normals, {n[0], n[1], n[2]});
    if (length(turned) > 0) n = to_float(normalize(turned));
  }
}

bool transform_round(const Transform& transform, Shape& shape) {
  const double before = length(shape.edge_u);
  shape.center = transform_point(transform, shape.center);
  for (Vec3* v : {&shape.edge_u, &shape.edge_v, &shape.axis}) *v = transform_vector(transform, *v);
  const bool reflects = determinant(transform) < 0;
  if (shape.kind == Shape::Kind::disk) {
    shape.flip_normals = shape.flip_normals != reflects;  // else edge_u x edge_v would turn with the reflection
    return true;
  }
  shape.radius *= length(shape.edge_u) / before;
  const bool across = perpendicular(shape.edge_u, shape.edge_v) && perpendicular(shape.edge_u, shape.axis) &&
                      perpendicular(shape.edge_v, shape.axis) && equal_lengths(shape.edge_u, shape.edge_v);
  if (shape.kind == Shape::Kind::cylinder) return across;
  return across && equal_lengths(shape.edge_u, shape.axis);
}

}  // namespace itn
