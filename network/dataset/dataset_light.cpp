#include "network/dataset/dataset_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "itn/bitmap.h"
#include "itn/colour.h"
#include "itn/error.h"
#include "runtime/base/random.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

constexpr double sun_widening = 70;      // of the sun's radius, at the same power, as in the authors' scenes
constexpr double sun_aperture = 0.5358;  // [degree], of the real sun
constexpr const char* emitter_id = "sky";
constexpr double most_negative = 1e-3;  // of a picture's light: above it, something is wrong

constexpr double room_irradiance = 3;  // of a horizontal surface, in luminance

// A lamp's profile. inside: the angle from its middle over its radius.
double soft(double inside) { return inside < 1 ? std::pow(1 - inside * inside, 2) : 0; }

double angle_between(const Vec3& a, const Vec3& b) { return std::acos(std::clamp(dot(a, b), -1.0, 1.0)); }

// All directions with the light of each, in Mitsuba's axes of pictures.
template <class LightFrom>
std::shared_ptr<const Bitmap> painted_room(const LightFrom& light_from) {
  constexpr int width = 64, height = 32;
  Bitmap picture{width, height, 3, {}};
  double irradiance = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double theta = std::numbers::pi * y / (height - 1), phi = 2 * std::numbers::pi * (x + 0.5) / width;
      const Vec3 towards{std::sin(theta) * std::sin(phi), std::cos(theta), -std::sin(theta) * std::cos(phi)};
      const Vec3 light = light_from(towards);
      const double solid_angle = std::sin(theta) * (std::numbers::pi / (height - 1)) * (2 * std::numbers::pi / width);
      irradiance += solid_angle * std::max(0.0, towards[1]) * luminance(light);
      for (const double value : light) picture.data.push_back(static_cast<float>(value));
    }
  for (float& value : picture.data) value *= static_cast<float>(room_irradiance / irradiance);
  return std::make_shared<const Bitmap>(std::move(picture));
}

// From warm (0) to white (1), of luminance 1.
Vec3 lamp_colour(double whiteness) {
  const Vec3 warm{1, 0.62, 0.3}, white{0.92, 1, 1.08};
  const Vec3 colour = (1 - whiteness) * warm + whiteness * white;
  return (1 / luminance(colour)) * colour;
}

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

std::shared_ptr<const Bitmap> lamp_room(std::uint64_t seed) {
  std::uint64_t drawn = 0;
  const auto draw = [&](double low, double high) { return low + (high - low) * random_uniform(seed, 0, drawn++); };
  struct Lamp {
    Vec3 towards, light;
    double radius;
  };
  std::vector<Lamp> lamps(1 + static_cast<std::size_t>(draw(0, 4)));
  for (Lamp& lamp : lamps) {
    const double z = draw(0.1, 1), phi = draw(0, 2 * std::numbers::pi), side = std::sqrt(1 - z * z);
    lamp.towards = {side * std::cos(phi), z, side * std::sin(phi)};  // Mitsuba's pictures have y up
    lamp.radius = draw(8, 25) * std::numbers::pi / 180;
    const double power = draw(0.3, 1);  // alike for small and large ones
    lamp.light = (power / (lamp.radius * lamp.radius)) * lamp_colour(draw(0, 1));
  }
  const Vec3 walls = draw(0.05, 0.5) * lamp_colour(draw(0, 1));
  return painted_room([&](const Vec3& towards) {
    Vec3 light = (1 + 0.5 * towards[1]) * walls;
    for (const Lamp& lamp : lamps)
      light = light + soft(angle_between(towards, lamp.towards) / lamp.radius) * lamp.light;
    return light;
  });
}

Environment lamp_alone(const Vec3& towards, double irradiance) {
  // A sun in its zenith, rotated to the lamp's direction.
  constexpr double of_scale_1 = 1.307;  // irradiance in luminance, as rendered: tests/dataset/world_test.cpp
  Environment lamp = make_environment("sunsky");
  lamp.id = emitter_id;
  lamp.sun.aperture = 20;
  lamp.set("sky_scale", 0);
  lamp.set("sun_scale", irradiance / of_scale_1);
  lamp.to_world = look_at({0, 0, 0}, towards, {0, 0, 1});
  return lamp;
}

// Mitsuba's pictures have y up, +z in their middle and -x to the right of it: the first two rotations make them z, +y
// and +x, as scenes/dataset/environment.xml does.
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
  if (light.lamps) return environment_light(lamp_room(*light.lamps), light.azimuth, 1);
  if (!light.environment) return sun_and_sky(light.direction);
  std::shared_ptr<const Bitmap>& picture = pictures_[light.environment->file];
  if (!picture) picture = read_environment(folder_ + "/" + light.environment->file);
  return environment_light(picture, light.azimuth, light.environment->scale);
}

}  // namespace itn
