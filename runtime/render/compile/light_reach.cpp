#include "runtime/render/compile/light_reach.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/shared/declaration.h"
#include "kernels/shared/light_layout.h"
#include "runtime/scene/mesh/mesh_topology.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

// A shape that shines is aimed at where it fills no more of what a body sees [sr]: sampled at the boundary, a larger
// one is as quiet, and connections from inside take time (kernels/README.md).
constexpr double widest_aim = 0.9;

// Media fill closed shapes alone.
bool is_closed(const Shape& shape) {
  if (shape.kind == Shape::Kind::sphere || shape.interior >= 0) return true;
  return shape.mesh && topology(*shape.mesh).closed();
}

// Winding number of the closed mesh around the point: the solid angles of its triangles (Van Oosterom and Strackee
// 1983, "The solid angle of a plane triangle").
double winding(const Mesh& mesh, const Vec3& point) {
  double sum = 0;
  for (const auto& t : mesh.triangle) {
    const Vec3 a = position_of(mesh, t[0]) - point, b = position_of(mesh, t[1]) - point,
               c = position_of(mesh, t[2]) - point;
    const double la = length(a), lb = length(b), lc = length(c);
    sum += std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

bool is_inside(const Shape& body, const Box& box, const Vec3& point) {
  for (std::size_t k = 0; k < 3; ++k)
    if (point[k] < static_cast<double>(box.low[k]) || point[k] > static_cast<double>(box.high[k])) return false;
  if (body.kind == Shape::Kind::sphere) return length(point - body.center) < body.radius;
  return body.mesh && std::abs(winding(*body.mesh, point)) > 0.5;
}

// A few points of a shape that shines, spread over it.
std::vector<Vec3> points_of(const Shape& shape, const LightSurfaces& surfaces) {
  constexpr std::size_t most = 8;
  if (!shape.mesh) return {surfaces.middle};
  std::vector<Vec3> points;
  const std::size_t vertices = shape.mesh->position.size(), step = (vertices + most - 1) / most;
  for (std::size_t i = 0; i < vertices; i += step)
    points.push_back(position_of(*shape.mesh, static_cast<std::uint32_t>(i)));
  return points;
}

// Position of a light that is no shape; none where it shines in parallel through all of the scene.
std::vector<Vec3> points_of(const Light& light) {
  const std::vector<double> n = light.model->to_numbers(light.variant, light.slots());
  if (light.model->traits & LIGHT_BEAM) {
    const auto center = static_cast<std::size_t>(light.model->number_called("center_x").slot);
    return {Vec3{n[center], n[center + 1], n[center + 2]}};
  }
  const Arrival arrival = light.model->arrives(n, Vec3{}, Vec3{}, Vec3{});
  if (!(arrival.distance < FAR_AWAY)) return {};
  return {arrival.distance * arrival.towards};
}

}  // namespace

RefractingBodies::RefractingBodies(const Scene& scene) {
  for (const Shape& shape : scene.shapes) {
    const Model* bsdf = scene.bsdfs[static_cast<std::size_t>(shape.bsdf)].model;
    if (!bsdf || !(bsdf->traits & BSDF_TRANSMITS) || (bsdf->traits & BSDF_THIN)) continue;
    bodies_.push_back({&shape, box_of(shape)});
    has_panes_ |= !(bsdf->traits & BSDF_SMOOTH) && !is_closed(shape);
  }
}

bool RefractingBodies::hold(const std::vector<Vec3>& points) const {
  return std::any_of(bodies_.begin(), bodies_.end(), [&](const Body& body) {
    return std::any_of(points.begin(), points.end(),
                       [&](const Vec3& point) { return is_inside(*body.shape, body.box, point); });
  });
}

int RefractingBodies::reach(const Light& light, const Shape* shape, const LightSurfaces* surfaces) const {
  if (!shape) return hold(points_of(light)) ? LIGHT_INSIDE : LIGHT_AIMED_AT;
  // A path in a medium meets only what says that it stands in it.
  if (shape->exterior >= 0 || hold(points_of(*shape, *surfaces))) return LIGHT_INSIDE;
  for (const Body& body : bodies_) {
    Vec3 to_light = surfaces->middle;
    for (std::size_t k = 0; k < 3; ++k)
      to_light[k] -= (static_cast<double>(body.box.low[k]) + static_cast<double>(body.box.high[k])) / 2;
    // a quarter of a closed shape's area faces the body, on average, or all of a flat one
    const double facing = std::max(0.25, std::abs(dot(normalize(to_light), surfaces->normal)));
    const double distance = length(to_light) - static_cast<double>(body.box.longest_side()) / 4;
    if (distance > 0 && surfaces->area * facing < widest_aim * distance * distance) return LIGHT_AIMED_AT;
  }
  return LIGHT_AT_BOUNDARIES;
}

}  // namespace itn
