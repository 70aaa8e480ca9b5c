#include "runtime/wavefront/launch_data.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "kernels/model/microfacet.h"
#include "kernels/shared/baseline_layout.h"
#include "runtime/derivative/parameter_chain.h"
#include "runtime/scene/emitter.h"

namespace itn {
namespace {

bool grey(const Rgb& c) { return c[0] == c[1] && c[1] == c[2]; }

void store(const Vec3& v, float out[3]) {
  for (std::size_t k = 0; k < 3; ++k) out[k] = static_cast<float>(v[k]);
}

Vec3 apply(const Transform& t, const Vec3& v, double w) {
  Vec3 r{};
  for (std::size_t i = 0; i < 3; ++i)
    r[i] = t.m[4 * i] * v[0] + t.m[4 * i + 1] * v[1] + t.m[4 * i + 2] * v[2] + t.m[4 * i + 3] * w;
  return r;
}

// See CameraRecord. Mitsuba's sensors look along local +z with +y up and +x to the left; rays start on the near plane.
CameraRecord camera_record(const Sensor& sensor, int first_medium) {
  CameraRecord r{};
  const double aspect = static_cast<double>(sensor.height) / sensor.width;
  const double x = sensor.orthographic ? 1 : std::tan(sensor.fov_x / 2 * std::numbers::pi / 180), y = x * aspect;
  const Vec3 along = apply(sensor.to_world, {0, 0, 1}, 0);
  const Vec3 right = apply(sensor.to_world, {x, 0, 0}, 0), up = apply(sensor.to_world, {0, y, 0}, 0);
  const double shift_a = 2 * sensor.principal_x, shift_b = 2 * sensor.principal_y;
  Vec3 start = apply(sensor.to_world, {0, 0, sensor.near_clip}, 1);
  const double spread = sensor.orthographic ? 1 : sensor.near_clip;
  Vec3 centre = along;
  for (std::size_t k = 0; k < 3; ++k) {
    const double shift = shift_a * right[k] + shift_b * up[k];
    start[k] += spread * shift;
    if (!sensor.orthographic) centre[k] += shift;
  }
  store(start, r.origin_0);
  store({spread * right[0], spread * right[1], spread * right[2]}, r.origin_a);
  store({spread * up[0], spread * up[1], spread * up[2]}, r.origin_b);
  store(centre, r.direction_0);
  if (!sensor.orthographic) {
    store(right, r.direction_a);
    store(up, r.direction_b);
  }
  r.inverse_width = 1.0f / static_cast<float>(sensor.width);
  r.inverse_height = 1.0f / static_cast<float>(sensor.height);
  r.crop_x = sensor.crop_x;
  r.crop_y = sensor.crop_y;
  r.crop_width = sensor.crop_width;
  r.filter = sensor.filter == FilterKind::box    ? FILTER_BOX
             : sensor.filter == FilterKind::tent ? FILTER_TENT
                                                 : FILTER_GAUSSIAN;
  r.filter_size = static_cast<float>(sensor.filter == FilterKind::tent ? sensor.filter_radius : sensor.filter_stddev);
  r.medium = sensor.medium < 0 ? -1 : first_medium + sensor.medium;
  return r;
}

int append_texture(const Texture& texture, LaunchData& data) {
  if (!texture.bitmap) return -1;
  const Bitmap& bitmap = *texture.bitmap;
  TextureRecord r{};
  const auto [known, is_new] = data.texels_of.try_emplace(&bitmap, static_cast<int>(data.texels.size()));
  r.offset = known->second;
  r.width = bitmap.width;
  r.height = bitmap.height;
  r.wrap = texture.wrap == Texture::Wrap::repeat   ? TEXTURE_REPEAT
           : texture.wrap == Texture::Wrap::mirror ? TEXTURE_MIRROR
                                                   : TEXTURE_CLAMP;
  r.nearest = texture.nearest;
  for (std::size_t k = 0; k < 6; ++k) r.to_uv[k] = static_cast<float>(texture.to_uv[k]);
  const std::size_t pixels = static_cast<std::size_t>(bitmap.width) * static_cast<std::size_t>(bitmap.height);
  const std::size_t channels = static_cast<std::size_t>(bitmap.channels);
  for (std::size_t i = 0; is_new && i < pixels; ++i)
    for (std::size_t c = 0; c < 3; ++c) data.texels.push_back(bitmap.data[i * channels + std::min(c, channels - 1)]);
  data.textures.push_back(r);
  data.coloured |= channels > 1;
  return static_cast<int>(data.textures.size()) - 1;
}

BsdfRecord bsdf_record(const Bsdf& bsdf, LaunchData& data) {
  BsdfRecord r{};
  switch (bsdf.kind) {
    case BsdfKind::null:
      r.kind = BSDF_NULL;
      break;
    case BsdfKind::diffuse:
      r.kind = BSDF_DIFFUSE;
      break;
    case BsdfKind::dielectric:
      r.kind = BSDF_DIELECTRIC;
      break;
    case BsdfKind::roughdielectric:
      r.kind = bsdf.distribution == Distribution::ggx ? BSDF_ROUGH_GGX : BSDF_ROUGH_BECKMANN;
      break;
  }
  r.alpha = static_cast<float>(std::max(bsdf.alpha, least_alpha));
  r.eta = static_cast<float>(relative_index(Numbers<double, 2>{bsdf.int_ior, bsdf.ext_ior})[0]);
  store(bsdf.reflectance.value, r.reflectance);
  r.texture = append_texture(bsdf.reflectance, data);
  store(bsdf.specular_reflectance, r.specular_reflectance);
  store(bsdf.specular_transmittance, r.specular_transmittance);
  r.twosided = bsdf.twosided;
  r.first_cell = data.cells;
  if (bsdf.kind == BsdfKind::roughdielectric) data.cells += BASELINE_BOUNDARY_CELLS;
  if (bsdf.kind == BsdfKind::diffuse)
    data.coloured |= r.texture < 0 && !grey(bsdf.reflectance.value);
  else
    data.coloured |= !grey(bsdf.specular_reflectance) || !grey(bsdf.specular_transmittance);
  return r;
}

MediumRecord medium_record(const Scene& scene, int index, LaunchData& data) {
  const Medium& medium = scene.media[static_cast<std::size_t>(index)];
  MediumRecord r{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double sigma_t = scaled_extinction(Numbers<double, 2>{medium.sigma_t[c], medium.scale})[0];
    r.sigma_t[c] = static_cast<float>(std::min(sigma_t, greatest_sigma_t));
  }
  store(medium.albedo, r.albedo);
  r.g = static_cast<float>(medium.isotropic ? 0 : std::clamp(medium.g, -greatest_g, greatest_g));
  for (const Shape& shape : scene.shapes) {
    const Bsdf& bsdf = scene.bsdfs[static_cast<std::size_t>(shape.bsdf)];
    if (bsdf.kind == BsdfKind::null && (shape.interior == index || shape.exterior == index))
      r.connection = CONNECTION_STRAIGHT;
    if (bsdf.kind == BsdfKind::roughdielectric && shape.interior == index && r.connection == CONNECTION_NONE) {
      r.connection = CONNECTION_REFRACTED;
      r.distribution = bsdf.distribution == Distribution::ggx ? MICROFACET_GGX : MICROFACET_BECKMANN;
      r.alpha = static_cast<float>(std::max(bsdf.alpha, least_alpha));
      r.eta = static_cast<float>(relative_index(Numbers<double, 2>{bsdf.int_ior, bsdf.ext_ior})[0]);
    }
  }
  r.first_cell = data.cells;
  data.cells += BASELINE_MEDIUM_CELLS;
  data.spectral |= !grey(medium.sigma_t);
  data.coloured |= !grey(medium.albedo) || !grey(medium.sigma_t);
  return r;
}

int append_record(const EmitterRecord& record, LaunchData& data) {
  data.emitters.push_back(record);
  return static_cast<int>(data.emitters.size()) - 1;
}

int append_light(const Emitter& light, LaunchData& data) {
  const bool shared = light.kind == Emitter::Kind::envmap && !light.sampled_as;
  const auto key = std::tuple(light.bitmap.get(), light.scale, light.to_world.m);
  if (shared && data.emitter_of.count(key)) return data.emitter_of[key];
  EmitterRecord record;
  append_emitter(light, record, data.emitter_tables);
  data.coloured_light |= light.kind != Emitter::Kind::constant || !grey(light.radiance);
  const int index = append_record(record, data);
  if (shared) data.emitter_of[key] = index;
  return index;
}

}  // namespace

JobRecord append_scene(const Scene& scene, int sensor, int geometry, LaunchData& data) {
  JobRecord job{};
  job.pixel_step = 1;
  job.geometry = geometry;
  const int first_medium = static_cast<int>(data.media.size()), first_bsdf = static_cast<int>(data.bsdfs.size());
  job.first_shape = static_cast<int>(data.shapes.size());
  job.first_medium = first_medium;
  job.first_bsdf = first_bsdf;
  const auto medium_index = [&](int medium) { return medium < 0 ? -1 : first_medium + medium; };
  for (int m = 0; m < static_cast<int>(scene.media.size()); ++m) data.media.push_back(medium_record(scene, m, data));
  for (const Bsdf& bsdf : scene.bsdfs) data.bsdfs.push_back(bsdf_record(bsdf, data));
  for (const Shape& shape : scene.shapes)
    data.shapes.push_back({first_bsdf + shape.bsdf, medium_index(shape.interior), medium_index(shape.exterior), 0});

  job.camera = static_cast<int>(data.cameras.size());
  const Sensor& camera = scene.sensors[static_cast<std::size_t>(sensor)];
  data.cameras.push_back(camera_record(camera, first_medium));
  data.pixels.push_back(camera.crop_width * camera.crop_height);

  job.emitter = scene.environment ? append_light(*scene.environment, data) : append_record({}, data);

  const int unlimited = 1 << 20;  // beyond any path: roulette ends them
  job.max_depth = scene.integrator.max_depth < 0 ? unlimited : scene.integrator.max_depth;
  job.rr_depth = scene.integrator.rr_depth;
  job.hide_emitters = scene.integrator.hide_emitters;
  std::fill_n(job.future_tint, 3, 1.0F);
  return job;
}

JobRecord append_scene(const Scene& scene, int sensor, LaunchData& data) {
  append_geometry(scene, data.geometry);
  return append_scene(scene, sensor, static_cast<int>(data.geometry.records.size()) - 1, data);
}

void clear_scenes(LaunchData& data) {
  LaunchData cleared;
  cleared.geometry = std::move(data.geometry);
  data = std::move(cleared);
}

std::map<std::string, std::string> feature_definitions(const LaunchData& data) {
  std::map<std::string, std::string> d = emitter_definitions(data.emitters);
  const auto set = [&](const char* name, bool value) { d[name] = std::to_string(value); };
  std::set<int> kinds;
  for (const BsdfRecord& bsdf : data.bsdfs) kinds.insert(bsdf.kind);
  bool matched = false, refracted = false;
  for (const MediumRecord& medium : data.media) {
    matched |= medium.connection == CONNECTION_STRAIGHT;
    refracted |= medium.connection == CONNECTION_REFRACTED;
  }
  bool smooth = false, round = false;
  for (const PrimitiveRecord& primitive : data.geometry.primitives) {
    smooth |= (primitive.flags & PRIMITIVE_SMOOTH) != 0;
    round |= (primitive.flags & (PRIMITIVE_SPHERE | PRIMITIVE_DISK)) != 0;
  }
  const bool uneven_light = std::any_of(data.emitters.begin(), data.emitters.end(), [](const EmitterRecord& e) {
    return e.kind == EMITTER_ENVMAP || e.kind == EMITTER_SUNSKY;
  });
  set("HAS_NULL", kinds.count(BSDF_NULL) > 0);
  set("HAS_DIFFUSE", kinds.count(BSDF_DIFFUSE) > 0);
  set("HAS_DIELECTRIC", kinds.count(BSDF_DIELECTRIC) > 0);
  set("HAS_ROUGH_BECKMANN", kinds.count(BSDF_ROUGH_BECKMANN) > 0);
  set("HAS_ROUGH_GGX", kinds.count(BSDF_ROUGH_GGX) > 0);
  set("HAS_MEDIUM", !data.media.empty());
  set("HAS_TEXTURE", !data.textures.empty());
  set("HAS_SMOOTH", smooth);
  set("HAS_ROUND", round);
  set("SPECTRAL", data.spectral);
  const bool sun = std::any_of(data.emitters.begin(), data.emitters.end(),
                               [](const EmitterRecord& e) { return e.kind == EMITTER_SUNSKY && e.sun_pdf > 0; });
  const bool rough_sun = sun && (kinds.count(BSDF_ROUGH_BECKMANN) > 0 || kinds.count(BSDF_ROUGH_GGX) > 0);
  const bool medium_light = (uneven_light && matched) || (sun && refracted);
  set("ROUGH_LIGHT_SAMPLING", rough_sun);
  set("MEDIUM_LIGHT_SAMPLING", medium_light);
  set("LIGHT_SAMPLING", medium_light || rough_sun || (uneven_light && kinds.count(BSDF_DIFFUSE) > 0));
  d["THROUGHPUT_CHANNELS"] = std::to_string(data.coloured ? 3 : 1);
  d["RADIANCE_CHANNELS"] = std::to_string(data.coloured || data.coloured_light ? 3 : 1);
  return d;
}

}  // namespace itn
