#include "runtime/dataset/dataset_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/base/colour.h"
#include "runtime/base/error.h"
#include "runtime/image/bitmap.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

constexpr double sun_widening = 70;      // of the sun's radius, at the same power, as in the authors' scenes
constexpr double sun_aperture = 0.5358;  // [degree], of the real sun
constexpr const char* emitter_id = "sky";
constexpr double most_negative = 1e-3;  // of a picture's light: above it, something is wrong

double luminance_at(const Bitmap& picture, std::size_t row, std::size_t column) {
  const auto channels = static_cast<std::size_t>(picture.channels);
  const float* p = picture.data.data() + (row * static_cast<std::size_t>(picture.width) + column) * channels;
  return channels == 1 ? static_cast<double>(p[0]) : luminance({p[0], p[1], p[2]});
}

}  // namespace

Vec3 sun_direction(double azimuth, double zenith) {
  const double a = azimuth * std::numbers::pi / 180, z = zenith * std::numbers::pi / 180;
  return {std::sin(z) * std::sin(a), std::sin(z) * std::cos(a), std::cos(z)};
}

Environment sun_and_sky(const Vec3& towards_sun) {
  Environment light = make_environment("sunsky");
  light.id = emitter_id;
  light.sun.direction = towards_sun;
  light.sun.aperture = sun_widening * sun_aperture;
  light.set("sun_scale", 2);
  return light;
}

std::shared_ptr<const Bitmap> read_environment(const std::string& file) {
  Bitmap picture = read_bitmap(file);
  if (picture.width < 3 || picture.height < 3)
    throw InputError(fmt::format("{}: has {} x {} pixels; need a picture of all directions, 3 x 3 or more", file,
                                 picture.width, picture.height));
  const auto refuse = [&](std::size_t i, const std::string& need) {
    const auto channels = static_cast<std::size_t>(picture.channels), width = static_cast<std::size_t>(picture.width);
    throw InputError(fmt::format("{}: column {}, row {}, channel {} is {}; {}: mend the image", file,
                                 i / channels % width, i / channels / width, i % channels, picture.data[i], need));
  };
  double positive = 0, negative = 0;
  std::size_t least = 0;
  for (std::size_t i = 0; i < picture.data.size(); ++i) {
    if (!std::isfinite(picture.data[i])) refuse(i, "need finite numbers");
    if (picture.data[i] < picture.data[least]) least = i;
    (picture.data[i] > 0 ? positive : negative) += std::abs(picture.data[i]);
  }
  if (negative > most_negative * positive)
    refuse(least, fmt::format("{:.2g} % of the light is negative, need {} % at most",
                              100 * negative / (positive + negative), 100 * most_negative));
  for (float& value : picture.data) value = std::max(value, 0.0F);
  return std::make_shared<const Bitmap>(std::move(picture));
}

// Mitsuba's pictures have y up, +z in their middle and -x to the right of it: the first two turns make them z, +y and
// +x, as scenes/dataset/environment.xml does.
Environment environment_light(std::shared_ptr<const Bitmap> picture, double azimuth, double scale) {
  Environment light = make_environment("envmap");
  light.id = emitter_id;
  light.bitmap = std::move(picture);
  light.set("scale", scale);
  light.to_world = rotate({0, 0, -1}, azimuth) * (rotate({0, 0, 1}, 180) * rotate({1, 0, 0}, 90));
  return light;
}

// Cell by cell between four pixels, as the renderer samples it.
Vec3 mean_direction(const Environment& environment) {
  const Bitmap& picture = *environment.bitmap;
  const auto width = static_cast<std::size_t>(picture.width), height = static_cast<std::size_t>(picture.height);
  Vec3 sum{0, 0, 0};
  for (std::size_t row = 0; row + 1 < height; ++row) {
    const double theta = (static_cast<double>(row) + 0.5) * std::numbers::pi / static_cast<double>(height - 1);
    for (std::size_t column = 0; column < width; ++column) {
      const std::size_t next = (column + 1) % width;
      const double light = luminance_at(picture, row, column) + luminance_at(picture, row, next) +
                           luminance_at(picture, row + 1, column) + luminance_at(picture, row + 1, next);
      const double phi = (static_cast<double>(column) + 1) * 2 * std::numbers::pi / static_cast<double>(width);
      const Vec3 towards = transform_vector(
          environment.to_world, {std::sin(theta) * std::sin(phi), std::cos(theta), -std::sin(theta) * std::cos(phi)});
      if (towards[2] > 0) sum = sum + light * std::sin(theta) * towards;
    }
  }
  return length(sum) > 0 ? normalize(sum) : Vec3{0, 0, 1};
}

Environment DatasetLights::of(int index) {
  const Manifest::Light& light = set_.lights[static_cast<std::size_t>(index)];
  if (!light.environment) return sun_and_sky(light.direction);
  std::shared_ptr<const Bitmap>& picture = pictures_[light.environment->file];
  if (!picture) picture = read_environment(folder_ + "/" + light.environment->file);
  return environment_light(picture, light.azimuth, light.environment->scale);
}

}  // namespace itn
