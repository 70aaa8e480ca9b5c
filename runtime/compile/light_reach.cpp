#include "runtime/compile/light_reach.h"

#include <algorithm>

#include "kernels/shared/declaration.h"
#include "kernels/shared/light_layout.h"
#include "runtime/scene/mesh/mesh_topology.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

bool meet(const Box& a, const Box& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (a.low[k] > b.high[k] || b.low[k] > a.high[k]) return false;
  return true;
}

// Media fill closed shapes alone.
bool is_closed(const Shape& shape) {
  if (shape.kind == Shape::Kind::sphere || shape.interior >= 0) return true;
  return shape.mesh && topology(*shape.mesh).closed();
}

std::array<float, 3> to_float(const Vec3& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

// The flat shape in which a beam begins.
Box box_of_beam(const Light& light, const std::vector<double>& n) {
  const auto vector = [&](const char* x) {
    const auto at = static_cast<std::size_t>(light.model->number_called(x).slot);
    return Vec3{n[at], n[at + 1], n[at + 2]};
  };
  const Vec3 center = vector("center_x"), to_u = vector("to_u_x"), to_v = vector("to_v_x"), normal = vector("normal_x");
  // The sides to which to_u and to_v tell the place.
  const Vec3 along_u = cross(to_v, normal), along_v = cross(to_u, normal);
  const Vec3 u = (1 / dot(to_u, along_u)) * along_u, v = (1 / dot(to_v, along_v)) * along_v;
  Box box;
  for (const double a : {-1.0, 1.0})
    for (const double b : {-1.0, 1.0}) box.add(to_float(center + a * u + b * v));
  return box;
}

// Where a light that is no shape stands: empty of one that shines in parallel through all of the scene.
Box box_of_light(const Light& light) {
  const std::vector<double> n = light.model->to_numbers(light.variant, light.slots());
  if (light.model->traits & LIGHT_BEAM) return box_of_beam(light, n);
  const Arrival arrival = light.model->arrives(n, Vec3{}, Vec3{}, Vec3{});
  Box box;
  if (arrival.distance < FAR_AWAY) box.add(to_float(arrival.distance * arrival.towards));
  return box;
}

}  // namespace

RefractingBodies::RefractingBodies(const Scene& scene) {
  for (const Shape& shape : scene.shapes) {
    const Model* bsdf = scene.bsdfs[static_cast<std::size_t>(shape.bsdf)].model;
    if (!bsdf || !(bsdf->traits & BSDF_TRANSMITS) || (bsdf->traits & BSDF_THIN)) continue;
    boxes_.push_back(box_of(shape));
    has_panes_ |= !(bsdf->traits & BSDF_SMOOTH) && !is_closed(shape);
  }
}

int RefractingBodies::reach(const Light& light, const Shape* shape) const {
  const Box place = shape ? box_of(*shape) : box_of_light(light);
  const auto holds = [&](const Box& body) { return meet(body, place); };
  if (std::any_of(boxes_.begin(), boxes_.end(), holds)) return LIGHT_INSIDE;
  return light.model->traits & LIGHT_ON_SHAPE ? LIGHT_AT_BOUNDARIES : LIGHT_AIMED_AT;
}

}  // namespace itn
