#include <algorithm>
#include <numbers>
#include <stdexcept>

#include "itn/colour.h"
#include "runtime/render/compile/environment/fill.h"
#include "runtime/scene/sky/hosek_wilkie.h"

namespace itn {
namespace {

constexpr double pi = std::numbers::pi;

bool positive(double x) { return x > 0 && std::isfinite(x); }

void check(const Environment& environment) {
  const SunSky s = sunsky_of(environment);
  const Sun& sun = s.sun;
  require(s.turbidity >= 1 && s.turbidity <= 10, environment, "turbidity", "in [1, 10]", s.turbidity);
  for (const double albedo : s.albedo) require(albedo >= 0 && albedo <= 1, environment, "albedo", "in [0, 1]", albedo);
  require(not_negative(s.sun_scale), environment, "sun_scale", "finite and not negative", s.sun_scale);
  require(not_negative(s.sky_scale), environment, "sky_scale", "finite and not negative", s.sky_scale);
  require(sun.aperture >= 0.01 && sun.aperture < 90, environment, "sun_aperture", "in [0.01, 90) degrees",
          sun.aperture);
  const double length = std::hypot(sun.direction[0], sun.direction[1], sun.direction[2]);
  require(positive(length), environment, "sun_direction", "a direction", fmt::format("a vector of length {}", length));
  require(sun.direction[2] > 0, environment, "sun_direction", "above the horizon",
          fmt::format("({}, {}, {}) where +z is up", sun.direction[0], sun.direction[1], sun.direction[2]),
          "to_world turns the horizon");
}

float to_float(double x) { return static_cast<float>(x); }

// Fills the coefficients of a clear sky and the radiance of its sun.
void set_radiance(const ClearSky& sky, EnvironmentRecord& record, std::vector<float>& tables) {
  for (std::size_t c = 0; c < 3; ++c) {
    std::transform(sky.sky[c].begin(), sky.sky[c].end(), record.sky + c * SKY_COEFFICIENTS, to_float);
    record.sun_radiance[c] = to_float(sky.sun_radiance[c]);
  }
  record.complex_sun = sky.limb.empty() ? 0 : 1;
  record.sun_table = static_cast<int>(tables.size());
  for (const auto& [value, slope] : sky.limb) {
    tables.push_back(to_float(value));
    tables.push_back(to_float(slope));
  }
}

// By one of the sky's numbers; by all components of the ground's albedo at once where it is one parameter.
ClearSky derivative_of(const SunSky& sunsky, const Parameter& p) {
  auto by = clear_sky_derivatives(sunsky);
  if (p.member == "turbidity") return by[SKY_TURBIDITY];
  if (p.member == "sun_scale") return by[SKY_SUN_SCALE];
  if (p.member == "sky_scale") return by[SKY_SKY_SCALE];
  if (p.member != "albedo") throw std::logic_error("not a parameter of the sky: " + p.name);
  if (p.component >= 0) return by[SKY_ALBEDO + static_cast<std::size_t>(p.component)];
  ClearSky& sum = by[SKY_ALBEDO];  // each channel depends on its own component, and the sun on none
  for (std::size_t c = 1; c < 3; ++c) sum.sky[c] = by[SKY_ALBEDO + c].sky[c];
  return sum;
}

}  // namespace

void sunsky_fill(const Environment& environment, EnvironmentRecord& record, std::vector<float>& tables) {
  check(environment);
  const ClearSky sky = clear_sky(sunsky_of(environment));
  set_radiance(sky, record, tables);

  // Sampling table: the mean luminance of each cell from 2 x 2 points.
  const double horizontal = std::hypot(sky.sun[0], sky.sun[1]);
  const double ca = horizontal > 0 ? sky.sun[0] / horizontal : 1, sa = horizontal > 0 ? sky.sun[1] / horizontal : 0;
  constexpr int points = 2;
  std::vector<double> weight(SKY_ROWS * SKY_COLUMNS);
  for (int row = 0; row < SKY_ROWS; ++row)
    for (int column = 0; column < SKY_COLUMNS; ++column) {
      double& cell = weight[static_cast<std::size_t>(row * SKY_COLUMNS + column)];
      const double z_low = row * row, z_step = 2 * row + 1;
      for (int i = 0; i < points; ++i)
        for (int j = 0; j < points; ++j) {
          const double z = (z_low + z_step * (i + 0.5) / points) / (SKY_ROWS * SKY_ROWS);
          const double phi = 2 * pi * (column + (j + 0.5) / points) / SKY_COLUMNS, r = std::sqrt(1 - z * z);
          const double a = r * std::cos(phi), b = r * std::sin(phi);
          cell += std::max(0.0, luminance(sky_radiance(sky, {a * ca - b * sa, a * sa + b * ca, z})));
        }
      cell *= z_step / (SKY_ROWS * SKY_ROWS) * 2 * pi / SKY_COLUMNS / (points * points);
    }
  record.sampling = append_sampling(weight, SKY_ROWS, SKY_COLUMNS, tables);
  record.sky_weight = to_float(sum(weight));
  record.sun_azimuth_cos = to_float(ca);
  record.sun_azimuth_sin = to_float(sa);

  // The sun and two directions across, in world space.
  const auto to_world = [&](const Vec3& v, float* out) {
    const auto& m = environment.to_world.m;
    for (std::size_t i = 0; i < 3; ++i) out[i] = to_float(m[4 * i] * v[0] + m[4 * i + 1] * v[1] + m[4 * i + 2] * v[2]);
  };
  const Vec3 tangent{-sa, ca, 0};
  const Vec3 bitangent{-sky.sun[2] * ca, -sky.sun[2] * sa, horizontal};
  std::transform(sky.sun.begin(), sky.sun.end(), record.sun_local, to_float);
  to_world(sky.sun, record.sun_direction);
  to_world(tangent, record.sun_tangent);
  to_world(bitangent, record.sun_bitangent);

  const double fall = 2 * std::pow(std::sin(sky.sun_half_angle / 2), 2);
  record.sun_cos = to_float(std::cos(sky.sun_half_angle));
  record.sun_one_minus_cos = to_float(fall);
  record.sun_chord2 = to_float(2 * fall);
  record.sun_pdf = to_float(1 / (2 * pi * fall));
  // The disc's light: the mean over points that share its solid angle evenly.
  double light = 0;
  for (int i = 0; i < 16; ++i)
    for (int j = 0; j < 16; ++j) {
      const double down = (i + 0.5) / 16 * fall, r = std::sqrt(down * (2 - down)), phi = 2 * pi * (j + 0.5) / 16;
      Vec3 direction;
      for (std::size_t k = 0; k < 3; ++k)
        direction[k] = (1 - down) * sky.sun[k] + r * (std::cos(phi) * tangent[k] + std::sin(phi) * bitangent[k]);
      light += std::max(0.0, luminance(sun_radiance(sky, direction))) * 2 * pi * fall / 256;
    }
  record.sun_weight = to_float(light);
}

void sunsky_move(const Environment& environment, const Parameter& p, EnvironmentRecord& moving,
                 std::vector<float>& tables) {
  set_radiance(derivative_of(sunsky_of(environment), p), moving, tables);
}

}  // namespace itn
