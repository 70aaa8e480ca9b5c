#include "runtime/render/compile/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "runtime/render/compile/light.h"
#include "runtime/scene/box.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

void store(const Vec3& v, float out[3]) {
  for (std::size_t k = 0; k < 3; ++k) out[k] = static_cast<float>(v[k]);
}

Vec3 apply(const Transform& t, const Vec3& v, double w) {
  Vec3 r{};
  for (std::size_t i = 0; i < 3; ++i)
    r[i] = t.m[4 * i] * v[0] + t.m[4 * i + 1] * v[1] + t.m[4 * i + 2] * v[2] + t.m[4 * i + 3] * w;
  return r;
}

// Distance from the camera at which its rays start [scene unit]: the near clip distance, or, where the whole scene is
// so far ahead that single precision would suffer, a point just before it.
double start_of_rays(const Sensor& sensor, const GeometryRecord& shapes) {
  constexpr double far_away = 64;
  double size = 0;
  for (int k = 0; k < 3; ++k) size = std::max(size, static_cast<double>(shapes.high[k] - shapes.low[k]));
  if (sensor.medium >= 0 || !(size > 0)) return sensor.near_clip;
  const Vec3 from = apply(sensor.to_world, {0, 0, 0}, 1), along = normalize(apply(sensor.to_world, {0, 0, 1}, 0));
  double nearest = std::numeric_limits<double>::infinity();
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p{};
    for (std::size_t k = 0; k < 3; ++k) p[k] = static_cast<double>((corner >> k & 1 ? shapes.high : shapes.low)[k]);
    nearest = std::min(nearest, dot(p - from, along));
  }
  if (!(nearest > far_away * size)) return sensor.near_clip;
  const double latest = 0.5 * (sensor.near_clip + sensor.far_clip);  // where all lies beyond far_clip nothing is seen
  return std::clamp(nearest - size, sensor.near_clip, std::max(latest, sensor.near_clip));
}

// See CameraRecord. Mitsuba's sensors look along local +z with +y up and +x to the left; rays start on the near plane.
void set_projection(const Sensor& sensor, double near, CameraRecord& r) {
  const bool parallel = sensor.kind == Sensor::Kind::orthographic;
  const double aspect = static_cast<double>(sensor.height) / sensor.width;
  const double x = parallel ? 1 : std::tan(sensor.fov_x / 2 * std::numbers::pi / 180);
  const double y = x * aspect * (parallel ? 1 : sensor.pixel_aspect);
  const Vec3 along = apply(sensor.to_world, {0, 0, 1}, 0);
  const Vec3 right = apply(sensor.to_world, {x, 0, 0}, 0), up = apply(sensor.to_world, {0, y, 0}, 0);
  // A pixel sees what lies the offset further to the right and below (as Mitsuba's images, not its manual, have it).
  const double shift_a = -2 * sensor.principal_x, shift_b = -2 * sensor.principal_y;
  Vec3 start = apply(sensor.to_world, {0, 0, near}, 1);
  const double spread = parallel ? 1 : near;
  Vec3 centre = along;
  for (std::size_t k = 0; k < 3; ++k) {
    const double shift = shift_a * right[k] + shift_b * up[k];
    start[k] += spread * shift;
    if (!parallel) centre[k] += shift;
  }
  store(start, r.origin_0);
  store({spread * right[0], spread * right[1], spread * right[2]}, r.origin_a);
  store({spread * up[0], spread * up[1], spread * up[2]}, r.origin_b);
  store(centre, r.direction_0);
  // The direction's part along the axis is that of `along` before it is made a unit vector.
  const double depth = sensor.far_clip - near;
  if (sensor.near_clip > 0) store((1 / (depth * length(along))) * along, r.clip);
  if (parallel) return;
  if (std::any_of(sensor.distortion.begin(), sensor.distortion.end(), [](double k) { return k != 0; })) {
    std::copy(sensor.distortion.begin(), sensor.distortion.end(), r.distortion);
    r.middle_a = static_cast<float>(-shift_a);
    r.middle_b = static_cast<float>(-shift_b);
    r.slope_a = static_cast<float>(x);
    r.slope_b = static_cast<float>(y);
  }
  store(right, r.direction_a);
  store(up, r.direction_b);
  store(apply(sensor.to_world, {sensor.aperture_radius, 0, 0}, 0), r.lens_a);
  store(apply(sensor.to_world, {0, sensor.aperture_radius, 0}, 0), r.lens_b);
  r.lens_start = static_cast<float>(1 - near / sensor.focus_distance);
  r.lens_turn = static_cast<float>(1 / sensor.focus_distance);
}

// Rays along one direction from before the scene: from a disk as wide as it, or towards the target.
void set_distant(const Scene& scene, const Sensor& sensor, CameraRecord& r) {
  Box box;
  for (const Shape& shape : scene.shapes) box.add(box_of(shape));
  const auto vector = [](const std::array<float, 3>& v) { return Vec3{v[0], v[1], v[2]}; };
  const double radius = length(vector(box.high) - vector(box.low)) / 2;
  const Vec3 centre = 0.5 * (vector(box.low) + vector(box.high)), d = sensor.direction;
  store(d, r.direction_0);
  if (sensor.zone) return store((2 * radius) * d, r.before);
  store(sensor.target ? *sensor.target - (2 * radius) * d : centre - radius * d, r.origin_0);
  if (sensor.target) return;
  const Vec3 across = normalize(cross(d, std::abs(d[0]) > 0.5 ? Vec3{0, 1, 0} : Vec3{1, 0, 0}));
  store(radius * across, r.lens_a);
  store(radius * cross(d, across), r.lens_b);
  r.lens_start = 1;
}

}  // namespace

void see_to_the_end(const GeometryRecord& geometry, CameraRecord& r) {
  for (int corner = 0; corner < 8; ++corner) {
    double depth = 0;
    for (int k = 0; k < 3; ++k) {
      const float place = (corner >> k & 1) != 0 ? geometry.high[k] : geometry.low[k];
      depth += (static_cast<double>(place) - static_cast<double>(r.origin_0[k])) * static_cast<double>(r.clip[k]);
    }
    if (depth > 0.999) return;
  }
  std::fill_n(r.clip, 3, 0.0F);
}

CameraRecord camera_record(const Scene& scene, const Sensor& sensor, const GeometryRecord& shapes, double in_front,
                           int first_medium, LaunchData& data) {
  CameraRecord r{};
  if (sensor.kind == Sensor::Kind::distant)
    set_distant(scene, sensor, r);
  else if (sensor.kind != Sensor::Kind::irradiance)
    set_projection(sensor, start_of_rays(sensor, shapes), r);
  if (sensor.zone) {
    r.measures = sensor.kind == Sensor::Kind::irradiance;
    const LightSurfaces zone = light_surfaces(*sensor.zone, r.measures ? in_front : 0);
    r.table = static_cast<int>(data.light_tables.size());
    r.surfaces = zone.count;
    data.light_tables.insert(data.light_tables.end(), zone.table.begin(), zone.table.end());
    data.round_zone |= sensor.zone->kind != Shape::Kind::mesh;
  }
  r.inverse_width = 1.0f / static_cast<float>(sensor.width);
  r.inverse_height = 1.0f / static_cast<float>(sensor.height);
  r.crop_x = sensor.crop_x;
  r.crop_y = sensor.crop_y;
  r.crop_width = sensor.crop_width;
  r.crop_height = sensor.crop_height;
  r.filter = sensor.filter == FilterKind::box    ? FILTER_BOX
             : sensor.filter == FilterKind::tent ? FILTER_TENT
                                                 : FILTER_GAUSSIAN;
  r.filter_size = static_cast<float>(sensor.filter == FilterKind::tent ? sensor.filter_radius : sensor.filter_stddev);
  if (!sensor.sample_border && r.filter != FILTER_BOX)
    r.filter_reach = r.filter_size * (r.filter == FILTER_GAUSSIAN ? 4.0f : 1.0f);
  r.medium = sensor.medium < 0 ? -1 : first_medium + sensor.medium;
  return r;
}

}  // namespace itn
