#include "runtime/render/compile/light.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "itn/colour.h"
#include "kernels/shared/declaration.h"
#include "kernels/shared/light_layout.h"
#include "runtime/render/compile/environment.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

constexpr double pi = std::numbers::pi;

struct Surface {
  int kind = LIGHT_TRIANGLE;
  Vec3 place{}, u{}, v{}, w{};
  double area = 0;
  Vec3 middle{}, normal{};  // mean normal
};

Vec3 to_double(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

std::vector<Surface> triangles_of(const Mesh& mesh) {
  std::vector<Surface> surfaces;
  surfaces.reserve(mesh.triangle.size());
  for (const auto& t : mesh.triangle) {
    Surface s;
    s.place = to_double(mesh.position[t[0]]);
    s.u = to_double(mesh.position[t[1]]) - s.place;
    s.v = to_double(mesh.position[t[2]]) - s.place;
    const Vec3 n = cross(s.u, s.v);
    s.area = length(n) / 2;
    s.w = s.normal = normalize(n);
    s.middle = s.place + (1.0 / 3) * (s.u + s.v);
    surfaces.push_back(s);
  }
  return surfaces;
}

Surface round_surface(const Shape& shape) {
  Surface s;
  s.place = s.middle = shape.center;
  s.u = shape.edge_u;
  s.v = shape.edge_v;
  if (shape.kind == Shape::Kind::sphere) {
    s.kind = LIGHT_SPHERE;
    s.u = {shape.radius, 0, 0};
    s.area = 4 * pi * shape.radius * shape.radius;
  } else if (shape.kind == Shape::Kind::cylinder) {
    s.kind = LIGHT_CYLINDER;
    s.w = shape.axis;
    s.area = 2 * pi * shape.radius * length(shape.axis);
    s.middle = shape.center + 0.5 * shape.axis;
  } else {
    s.kind = LIGHT_DISK;
    const Vec3 n = cross(s.u, s.v);
    s.area = pi * length(n);
    s.w = s.normal = (shape.flip_normals ? -1.0 : 1.0) * normalize(n);
  }
  return s;
}

void append(const Surface& s, bool turned, double offset, int primitive, std::vector<float>& table) {
  for (const Vec3& v : {s.place, s.u, s.v, s.w})
    for (const double x : v) table.push_back(static_cast<float>(x));
  table.push_back(static_cast<float>(s.kind));
  table.push_back(turned ? -1.0F : 1.0F);
  table.push_back(static_cast<float>(offset));
  table.push_back(std::bit_cast<float>(primitive));
}

}  // namespace

LightSurfaces light_surfaces(const Shape& shape, double offset, int first_primitive) {
  const std::vector<Surface> surfaces =
      shape.mesh ? triangles_of(*shape.mesh) : std::vector<Surface>{round_surface(shape)};
  LightSurfaces result;
  result.count = static_cast<int>(surfaces.size());
  std::vector<double> areas;
  areas.reserve(surfaces.size());
  for (const Surface& s : surfaces) {
    areas.push_back(s.area);
    result.area += s.area;
    result.middle = result.middle + s.area * s.middle;
    result.normal = result.normal + s.area * s.normal;
  }
  result.middle = (1 / result.area) * result.middle;
  result.normal = (1 / result.area) * result.normal;
  append_cumulative(areas.data(), areas.size(), result.table);
  for (std::size_t i = 0; i < surfaces.size(); ++i)
    append(surfaces[i], shape.flip_normals && !shape.mesh, offset, first_primitive + static_cast<int>(i), result.table);
  return result;
}

double expected_irradiance(const Light& light, const LightSurfaces* surfaces, const Vec3& low, const Vec3& high,
                           int steps) {
  const std::vector<double> n = light.model->to_numbers(light.variant, light.slots());
  const bool shows_texture = (light.model->traits & LIGHT_ON_SHAPE) != 0 && (light.model->traits & LIGHT_TINTED) != 0;
  const Rgb mean = shows_texture ? Rgb{n[3], n[4], n[5]} : Rgb{1, 1, 1};
  const double brightness = luminance(Rgb{n[0] * mean[0], n[1] * mean[1], n[2] * mean[2]}), size = length(high - low);
  double sum = 0;
  for (int i = 0; i < steps * steps * steps; ++i) {
    const std::array<int, 3> step{i % steps, i / steps % steps, i / (steps * steps)};
    Vec3 from{};
    for (std::size_t k = 0; k < 3; ++k) from[k] = low[k] + (high[k] - low[k]) * (step[k] + 0.5) / steps;
    const Arrival a = light.model->arrives(n, from, surfaces ? surfaces->middle : Vec3{}, Vec3{});
    const double distance = std::max(a.distance, size / steps);  // near a light it is much brighter, in few places
    if (surfaces)
      sum += surfaces->area * std::max(0.25, -dot(a.towards, surfaces->normal)) / (distance * distance);
    else
      sum += a.share * std::pow(a.distance / distance, 2);
  }
  return brightness * sum / (steps * steps * steps);
}

}  // namespace itn
