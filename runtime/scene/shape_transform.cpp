#include "runtime/scene/shape_transform.h"

#include <algorithm>
#include <cmath>

#include "runtime/scene/transform.h"

namespace itn {
namespace {

// Are they at right angles, in single precision's measure?
bool perpendicular(const Vec3& a, const Vec3& b) { return std::abs(dot(a, b)) <= 1e-4 * length(a) * length(b); }
bool equal_lengths(const Vec3& a, const Vec3& b) {
  return std::abs(dot(a, a) - dot(b, b)) <= 1e-4 * std::max(dot(a, a), dot(b, b));
}

}  // namespace

bool transform_round(const Transform& transform, Shape& shape) {
  const double before = length(shape.edge_u);
  shape.center = transform_point(transform, shape.center);
  for (Vec3* v : {&shape.edge_u, &shape.edge_v, &shape.axis}) *v = transform_vector(transform, *v);
  const bool reflects = determinant(transform) < 0;
  if (shape.kind == Shape::Kind::disk) {
    shape.flip_normals = shape.flip_normals != reflects;  // else edge_u x edge_v would flip with the reflection
    return true;
  }
  shape.radius *= length(shape.edge_u) / before;
  const bool across = perpendicular(shape.edge_u, shape.edge_v) && perpendicular(shape.edge_u, shape.axis) &&
                      perpendicular(shape.edge_v, shape.axis) && equal_lengths(shape.edge_u, shape.edge_v);
  if (shape.kind == Shape::Kind::cylinder) return across;
  return across && equal_lengths(shape.edge_u, shape.axis);
}

}  // namespace itn
