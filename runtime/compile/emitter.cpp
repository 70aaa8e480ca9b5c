#include "runtime/compile/emitter.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "runtime/base/colour.h"
#include "runtime/base/error.h"
#include "runtime/scene/hosek_wilkie.h"

namespace itn {

namespace {

constexpr double pi = std::numbers::pi;

// "file:line:column: turbidity of the sunsky emitter must be in [1, 10]; got 11"
template <class Value>
void require(bool good, const Emitter& emitter, const char* parameter, const char* need, const Value& got,
             const char* remedy = "") {
  if (good) return;
  static const char* const kinds[] = {"constant", "envmap", "sunsky"};
  const auto& at = emitter.where;
  throw InputError(fmt::format("{}:{}:{}: {} of the {} emitter must be {}; got {}{}{}", at.file, at.line, at.column,
                               parameter, kinds[static_cast<int>(emitter.kind)], need, got, *remedy ? ": " : "",
                               remedy));
}

bool positive(double x) { return x > 0 && std::isfinite(x); }
bool not_negative(double x) { return x >= 0 && std::isfinite(x); }

// The inverse of the upper left 3x3 of to_world, which must be a rotation or a mirrored one.
void set_rotation(const Emitter& emitter, EmitterRecord& record) {
  const auto& m = emitter.to_world.m;
  bool rigid = true;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      double product = 0;
      for (std::size_t k = 0; k < 3; ++k) product += m[4 * k + i] * m[4 * k + j];
      rigid = rigid && std::abs(product - (i == j ? 1 : 0)) < 1e-4;
      record.to_local[3 * i + j] = static_cast<float>(m[4 * j + i]);
    }
  require(rigid, emitter, "to_world", "a rotation or a mirrored one", "a matrix that scales or shears",
          "light from infinity has no size; remove the scale");
}

void append_constant(const Emitter& emitter, EmitterRecord& record) {
  for (std::size_t c = 0; c < 3; ++c) {
    require(not_negative(emitter.radiance[c]), emitter, "radiance", "finite and not negative", emitter.radiance[c]);
    record.radiance[c] = static_cast<float>(emitter.radiance[c]);
  }
  record.sky_weight = static_cast<float>(4 * pi * luminance(emitter.radiance));
}

// weight: the light of each cell, row by row.
int append_sampling(const std::vector<double>& weight, std::size_t rows, std::size_t columns,
                    std::vector<float>& tables) {
  const auto offset = static_cast<int>(tables.size());
  std::vector<double> row_weight(rows);
  for (std::size_t i = 0; i < weight.size(); ++i) row_weight[i / columns] += weight[i];
  append_cumulative(row_weight.data(), rows, tables);
  for (std::size_t i = 0; i < rows; ++i) append_cumulative(weight.data() + i * columns, columns, tables);
  return offset;
}

double sum(const std::vector<double>& values) {
  double total = 0;
  for (const double value : values) total += value;
  return total;
}

void refuse_pixel(const Emitter& emitter, std::size_t x, std::size_t y, std::size_t c, float value) {
  const auto got = fmt::format("{} at column {}, row {}, channel {}", value, x, y, c);
  require(not_negative(value), emitter, "bitmap", "finite and not negative", got, "repair the image");
  require(false, emitter, "bitmap", "in the range of 32-bit floats once scaled", got, "lower the scale");
}

void append_envmap(const Emitter& emitter, EmitterRecord& record, std::vector<float>& tables) {
  require(emitter.bitmap != nullptr, emitter, "bitmap", "an image", "none");
  const Bitmap& bitmap = *emitter.bitmap;
  require(bitmap.width >= 3 && bitmap.height >= 3, emitter, "bitmap", "at least 3 x 3 pixels",
          fmt::format("{} x {}", bitmap.width, bitmap.height), "for light of one colour use a constant emitter");
  require(not_negative(emitter.scale), emitter, "scale", "finite and not negative", emitter.scale);
  const auto width = static_cast<std::size_t>(bitmap.width), height = static_cast<std::size_t>(bitmap.height);
  const auto channels = static_cast<std::size_t>(bitmap.channels);
  require(tables.size() + 4 * (width + 2) * (height + 1) < std::numeric_limits<int>::max(), emitter, "bitmap",
          "small enough to address with 31 bits", fmt::format("{} x {} pixels", width, height), "scale it down");

  std::fill_n(record.radiance, 3, static_cast<float>(emitter.scale));
  record.width = bitmap.width;
  record.height = bitmap.height;
  record.pixels = static_cast<int>(tables.size());
  tables.reserve(tables.size() + 3 * (width + 1) * height + height * (width + 2));
  std::vector<double> light(width * height);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x <= width; ++x) {
      Rgb rgb;
      for (std::size_t c = 0; c < 3; ++c) {
        const float value = bitmap.data[(y * width + x % width) * channels + (channels == 1 ? 0 : c)];
        rgb[c] = emitter.scale * value;
        if (!(not_negative(value) && rgb[c] <= std::numeric_limits<float>::max()))
          refuse_pixel(emitter, x, y, c, value);
        tables.push_back(value);
      }
      if (x < width) light[y * width + x] = luminance(rgb);
    }

  // A cell lies between four pixels.
  std::vector<double> weight;
  const double step = pi / static_cast<double>(height - 1);
  for (std::size_t y = 0; y + 1 < height; ++y) {
    const double solid_angle =
        2 * std::sin((static_cast<double>(y) + 0.5) * step) * std::sin(step / 2) * 2 * pi / static_cast<double>(width);
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t left = y * width + x, right = y * width + (x + 1) % width;
      weight.push_back(solid_angle * (light[left] + light[right] + light[left + width] + light[right + width]) / 4);
    }
  }
  record.sampling = append_sampling(weight, height - 1, width, tables);
  record.sky_weight = static_cast<float>(sum(weight));
}

void check_sunsky(const Emitter& emitter) {
  const SunSky& s = emitter.sunsky;
  require(s.turbidity >= 1 && s.turbidity <= 10, emitter, "turbidity", "in [1, 10]", s.turbidity);
  for (const double albedo : s.albedo) require(albedo >= 0 && albedo <= 1, emitter, "albedo", "in [0, 1]", albedo);
  require(not_negative(s.sun_scale), emitter, "sun_scale", "finite and not negative", s.sun_scale);
  require(not_negative(s.sky_scale), emitter, "sky_scale", "finite and not negative", s.sky_scale);
  require(s.sun_aperture >= 0.01 && s.sun_aperture < 90, emitter, "sun_aperture", "in [0.01, 90) degrees",
          s.sun_aperture);
  const double length = std::hypot(s.sun_direction[0], s.sun_direction[1], s.sun_direction[2]);
  require(positive(length), emitter, "sun_direction", "a direction", fmt::format("a vector of length {}", length));
  require(s.sun_direction[2] > 0, emitter, "sun_direction", "above the horizon",
          fmt::format("({}, {}, {}) where +z is up", s.sun_direction[0], s.sun_direction[1], s.sun_direction[2]),
          "to_world turns the horizon");
}

float to_float(double x) { return static_cast<float>(x); }

// What the light of a clear sky is made of.
void set_radiance(const ClearSky& sky, EmitterRecord& record, std::vector<float>& tables) {
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

void append_sunsky(const Emitter& emitter, EmitterRecord& record, std::vector<float>& tables) {
  check_sunsky(emitter);
  const ClearSky sky = clear_sky(emitter.sunsky);
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
    const auto& m = emitter.to_world.m;
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

void append_cumulative(const double* weight, std::size_t n, std::vector<float>& tables) {
  constexpr double grid = 0x1p24, least = 4 / grid;
  double total = 0, raised = 0;
  for (std::size_t i = 0; i < n; ++i) total += weight[i];
  const auto share = [&](std::size_t i) {
    if (!(total > 0)) return 1.0;
    return weight[i] > 0 ? std::max(weight[i] / total, least) : 0.0;
  };
  for (std::size_t i = 0; i < n; ++i) raised += share(i);
  double sum = 0;
  tables.push_back(0);
  for (std::size_t i = 0; i < n; ++i) {
    sum += share(i);
    tables.push_back(static_cast<float>(std::min(std::round(sum / raised * grid), grid) / grid));
  }
  tables.back() = 1;
}

EmitterRecord emitter_derivative(const Emitter& emitter, const Parameter& p, const EmitterRecord& record,
                                 std::vector<float>& tables) {
  EmitterRecord result = record;
  if (emitter.kind == Emitter::Kind::sunsky)
    set_radiance(derivative_of(emitter.sunsky, p), result, tables);
  else  // linear in `radiance`, which is the parameter itself
    for (int c = 0; c < 3; ++c) result.radiance[c] = p.component < 0 || p.component == c ? 1.0F : 0.0F;
  return result;
}

void append_emitter(const Emitter& emitter, EmitterRecord& record, std::vector<float>& tables) {
  record = {};
  set_rotation(emitter, record);
  switch (emitter.kind) {
    case Emitter::Kind::constant:
      record.kind = EMITTER_CONSTANT;
      append_constant(emitter, record);
      break;
    case Emitter::Kind::envmap:
      record.kind = EMITTER_ENVMAP;
      append_envmap(emitter, record, tables);
      break;
    case Emitter::Kind::sunsky:
      record.kind = EMITTER_SUNSKY;
      append_sunsky(emitter, record, tables);
      break;
  }
  if (!emitter.sampled_as) return;
  if (emitter.sampled_as->kind != emitter.kind) throw std::logic_error("light sampled as light of another kind");
  EmitterRecord other;
  append_emitter(*emitter.sampled_as, other, tables);
  record.sampling = other.sampling;
  record.sun_weight = other.sun_weight;
  record.sky_weight = other.sky_weight;
}

std::map<std::string, std::string> emitter_definitions(const std::vector<EmitterRecord>& records) {
  std::map<std::string, std::string> definitions;
  for (const auto& record : records) {
    if (record.kind == EMITTER_ENVMAP) definitions.emplace("HAS_ENVMAP", "1");
    if (record.kind == EMITTER_SUNSKY) definitions.emplace("HAS_SUN", "1");
    if (record.complex_sun) definitions.emplace("HAS_COMPLEX_SUN", "1");
  }
  return definitions;
}

}  // namespace itn
