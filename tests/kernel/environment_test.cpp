#include "runtime/render/compile/environment.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include "itn/colour.h"
#include "itn/device.h"
#include "itn/error.h"
#include "runtime/render/compile/surfaces.h"
#include "runtime/scene/model/sized_model.h"
#include "runtime/scene/sky/hosek_wilkie.h"

namespace {

using namespace itn;
constexpr double pi = std::numbers::pi;

struct RecordedRadiance {
  Vec3 direction;
  Rgb radiance;
};
struct RecordedSky {
  double turbidity;
  Rgb albedo;
  Vec3 sun_direction;  // world: Mitsuba's parameter
  double sun_aperture;
  bool complex_sun;
  std::array<double, 9> to_world;
  std::vector<RecordedRadiance> values;
};
struct RecordedMap {
  std::array<double, 9> to_world;
  std::vector<RecordedRadiance> values;
};
#include "environment_mitsuba.inc"

// Runs the functions of kernels/light/environment.h for an emitter, at one width.
class OnDevice {
 public:
  OnDevice(const Environment& emitter, int width) : width_(width) {
    append_environment(emitter, record, tables);
    auto definitions = environment_definitions({record});
    definitions["WIDTH"] = std::to_string(width);
    setenv("ITN_KERNEL_DIR", ITN_SOURCE_DIR "/tests/kernel", 1);
    LaunchData launch;
    launch.environments = {record};
    program_ = device_.build("environment_test.cl", definitions, {{"program/surfaces.h", surfaces_text(launch)}});
    unsetenv("ITN_KERNEL_DIR");
    record_ = device_.upload(std::vector<EnvironmentRecord>{record}, "record");
    tables_ = device_.upload(tables, "tables");
  }

  // Another emitter of the same kind.
  void replace(const Environment& emitter) {
    tables.clear();
    append_environment(emitter, record, tables);
    record_ = device_.upload(std::vector<EnvironmentRecord>{record}, "record");
    tables_ = device_.upload(tables, "tables");
  }

  struct Value {
    Rgb sky, sun;
    double pdf;
    bool inside;
  };
  std::vector<Value> evaluate(const std::vector<Vec3>& directions) const {
    const auto out = launch("evaluate", directions, 8, 0);
    std::vector<Value> values;
    for (const auto& v : out) values.push_back({{v[0], v[1], v[2]}, {v[3], v[4], v[5]}, v[6], v[7] != 0});
    REQUIRE(std::all_of(out.begin(), out.end(), [](const auto& v) { return v[7] == 0 || v[7] == 3; }));  // in_sun
    return values;
  }

  struct Sample {
    Vec3 direction;
    Rgb radiance;
    double pdf;
  };
  std::vector<Sample> sample(const std::vector<Vec2>& u, bool of_sun) const {
    const auto out = launch("sample", u, 7, of_sun);
    std::vector<Sample> samples;
    for (const auto& v : out) samples.push_back({{v[0], v[1], v[2]}, {v[3], v[4], v[5]}, v[6]});
    return samples;
  }

  EnvironmentRecord record;
  std::vector<float> tables;

 private:
  template <class In>
  std::vector<std::array<float, 8>> launch(const char* name, const std::vector<In>& in, std::size_t outputs,
                                           int argument) const {
    const auto groups = (in.size() + static_cast<std::size_t>(width_) - 1) / static_cast<std::size_t>(width_);
    const auto n = groups * static_cast<std::size_t>(width_);
    std::vector<float> flat(n * std::tuple_size_v<In>), result(n * outputs);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t c = 0; c < std::tuple_size_v<In>; ++c)
        flat[c * n + i] = static_cast<float>(in[std::min(i, in.size() - 1)][c]);
    const cl::Buffer from = device_.upload(flat, "in"), to = device_.upload(result, "out");
    cl::Kernel kernel(program_, name);
    kernel.setArg(0, record_);
    kernel.setArg(1, tables_);
    kernel.setArg(2, from);
    kernel.setArg(3, to);
    if (std::string(name) == "sample") kernel.setArg(4, argument);
    device_.launch(kernel, groups, 1);
    device_.finish();
    device_.download(to, result);
    std::vector<std::array<float, 8>> rows(in.size());
    for (std::size_t i = 0; i < in.size(); ++i)
      for (std::size_t c = 0; c < outputs; ++c) rows[i][c] = result[c * n + i];
    return rows;
  }

  int width_;
  Device device_;
  cl::Program program_;
  cl::Buffer record_, tables_;
};

std::vector<Vec3> random_directions(std::size_t n, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<Vec3> directions(n);
  for (auto& d : directions) {
    for (auto& x : d) x = normal(generator);
    const double length = std::hypot(d[0], d[1], d[2]);
    for (auto& x : d) x /= length;
  }
  return directions;
}

// Uniform numbers as the device makes them: multiples of 2^-24 in [0, 1).
std::vector<Vec2> random_numbers(std::size_t n, unsigned seed) {
  std::mt19937 generator(seed);
  std::vector<Vec2> u(n);
  for (auto& v : u)
    for (auto& x : v) x = static_cast<double>(generator() >> 8) * 0x1p-24;
  return u;
}

const int widths[] = {1, 16};

}  // namespace

TEST_CASE("constant light is the same from everywhere and sampled uniformly") {
  Environment emitter;
  emitter.set("radiance", {0.5, 1, 2});
  for (const int width : widths) {
    const OnDevice light(emitter, width);
    for (const auto& value : light.evaluate(random_directions(33, 1))) {
      for (std::size_t c = 0; c < 3; ++c) {
        REQUIRE(value.sky[c] == emitter.colour("radiance")[c]);
        REQUIRE(value.sun[c] == 0);
      }
      REQUIRE(!value.inside);
      REQUIRE(value.pdf == Approx(1 / (4 * pi)));
    }
    Vec3 mean{}, square{};
    const std::size_t n = 20000;
    for (const auto& s : light.sample(random_numbers(n, 2), false)) {
      REQUIRE(std::hypot(s.direction[0], s.direction[1], s.direction[2]) == Approx(1).epsilon(1e-6));
      REQUIRE(s.pdf == Approx(1 / (4 * pi)));
      REQUIRE(s.radiance == emitter.colour("radiance"));
      for (std::size_t c = 0; c < 3; ++c) {
        mean[c] += s.direction[c] / n;
        square[c] += s.direction[c] * s.direction[c] / n;
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK(std::abs(mean[c]) < 5 * std::sqrt(1.0 / 3 / n));               // variance 1/3
      CHECK(std::abs(square[c] - 1.0 / 3) < 5 * std::sqrt(4.0 / 45 / n));  // variance 1/5 - 1/9
    }
  }
}

namespace {

void turn(Environment& emitter, const std::array<double, 9>& rotation) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) emitter.to_world.m[4 * i + j] = rotation[3 * i + j];
}

Environment sunsky(double elevation_degree, double turbidity, double aperture, bool complex_sun = false) {
  const double e = elevation_degree * pi / 180;
  Environment emitter = make_environment("sunsky");
  emitter.set("turbidity", turbidity);
  emitter.sun.direction = {std::cos(e) * std::cos(0.7), std::cos(e) * std::sin(0.7), std::sin(e)};
  emitter.sun.aperture = aperture;
  emitter.sun.complex = complex_sun;
  return emitter;
}

Vec3 to_local(const Environment& emitter, const Vec3& d) {
  const auto& m = emitter.to_world.m;
  Vec3 local;
  for (std::size_t i = 0; i < 3; ++i) local[i] = m[i] * d[0] + m[4 + i] * d[1] + m[8 + i] * d[2];
  return local;
}

// The map of environment_mitsuba.py.
Environment small_envmap() {
  auto bitmap = std::make_shared<Bitmap>();
  *bitmap = {5, 4, 3, {}};
  for (int i = 0; i < 60; ++i) bitmap->data.push_back(static_cast<float>(i * 7 % 11));
  Environment emitter = make_environment("envmap");
  emitter.bitmap = bitmap;
  emitter.set("scale", 1.5);
  return emitter;
}

// Cosine to the normal of some plane.
double plane(const Vec3& d) { return 0.6 * d[0] + 0.8 * d[2]; }

Environment recorded_emitter(const RecordedSky& recorded) {
  Environment emitter = make_environment("sunsky");
  turn(emitter, recorded.to_world);
  emitter.set("turbidity", recorded.turbidity);
  emitter.set("albedo", recorded.albedo);
  emitter.set("sun_scale", 2);
  emitter.set("sky_scale", 3);
  emitter.sun = {to_local(emitter, recorded.sun_direction), recorded.sun_aperture, recorded.complex_sun};
  return emitter;
}

// Largest difference of a channel, as a share of the largest channel.
double difference(const Rgb& a, const Rgb& b) {
  double error = 0, size = 1e-9;
  for (std::size_t c = 0; c < 3; ++c) {
    error = std::max(error, std::abs(a[c] - b[c]));
    size = std::max({size, std::abs(a[c]), std::abs(b[c])});
  }
  return error / size;
}

Rgb operator+(const Rgb& a, const Rgb& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

}  // namespace

TEST_CASE("sun and sky have Mitsuba's radiance") {
  for (const auto& recorded : recorded_skies) {
    const Environment emitter = recorded_emitter(recorded);
    const ClearSky sky = clear_sky(sunsky_of(emitter));
    std::vector<Vec3> directions;
    for (const auto& value : recorded.values) directions.push_back(value.direction);
    for (const auto& [direction, radiance] : recorded.values) {
      const Vec3 local = to_local(emitter, direction);
      CAPTURE(recorded.turbidity, local, radiance);
      CHECK(difference(sky_radiance(sky, local) + sun_radiance(sky, local), radiance) < 2e-5);
    }
    for (const int width : widths) {
      const auto values = OnDevice(emitter, width).evaluate(directions);
      for (std::size_t i = 0; i < values.size(); ++i) {
        CAPTURE(recorded.turbidity, to_local(emitter, directions[i]), values[i].sky, values[i].sun);
        CHECK(difference(values[i].sky + values[i].sun, recorded.values[i].radiance) < 2e-5);
      }
    }
  }
}

TEST_CASE("an environment map has Mitsuba's radiance") {
  for (const auto& recorded : recorded_maps) {
    Environment emitter = small_envmap();
    turn(emitter, recorded.to_world);
    std::vector<Vec3> directions;
    for (const auto& value : recorded.values) directions.push_back(value.direction);
    for (const int width : widths) {
      const auto values = OnDevice(emitter, width).evaluate(directions);
      for (std::size_t i = 0; i < values.size(); ++i) {
        CAPTURE(directions[i], values[i].sky, recorded.values[i].radiance);
        CHECK(difference(values[i].sky, recorded.values[i].radiance) < 1e-5);
        CHECK(!values[i].inside);
      }
    }
  }
}

namespace {

double solid_angle(const EnvironmentRecord& record) { return 1 / record.sun_pdf; }

// Pearson's statistic, as the number of standard deviations by which it exceeds its mean (Wilson-Hilferty).
double chi_square_deviations(const std::vector<double>& observed, const std::vector<double>& expected) {
  double chi2 = 0, cells = -1, rest_observed = 0, rest_expected = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (expected[i] < 10) {
      rest_observed += observed[i];
      rest_expected += expected[i];
      continue;
    }
    chi2 += std::pow(observed[i] - expected[i], 2) / expected[i];
    ++cells;
  }
  if (rest_expected > 10) {
    chi2 += std::pow(rest_observed - rest_expected, 2) / rest_expected;
    ++cells;
  } else if (rest_expected < 1e-9 && rest_observed > 0) {
    return 1e9;
  }
  const double spread = 2 / (9 * cells);
  return (std::cbrt(chi2 / cells) - (1 - spread)) / std::sqrt(spread);
}

// Cells of equal solid angle over the sphere, about the z axis.
constexpr int z_cells = 20, phi_cells = 36;
std::size_t cell_of(const Vec3& d) {
  const double phi = std::atan2(d[1], d[0]) / (2 * pi);
  const int z = std::clamp(static_cast<int>((d[2] + 1) / 2 * z_cells), 0, z_cells - 1);
  return static_cast<std::size_t>(z * phi_cells +
                                  std::clamp(static_cast<int>((phi + 0.5) * phi_cells), 0, phi_cells - 1));
}

// A fine grid of directions of equal solid angles, in the order of cell_of: sub x sub to a cell.
std::vector<Vec3> grid(int sub) {
  std::vector<Vec3> directions;
  for (int z = 0; z < z_cells; ++z)
    for (int phi = 0; phi < phi_cells; ++phi)
      for (int i = 0; i < sub * sub; ++i) {
        const double cosine = 2 * (z + (i / sub + 0.5) / sub) / z_cells - 1;
        const double angle = 2 * pi * ((phi + (i % sub + 0.5) / sub) / phi_cells - 0.5),
                     r = std::sqrt(1 - cosine * cosine);
        directions.push_back({r * std::cos(angle), r * std::sin(angle), cosine});
      }
  return directions;
}

void check_sky_sampling(const Environment& emitter, double variance_limit, const std::string& name) {
  constexpr int sub = 20;
  constexpr std::size_t n = 200000;
  const auto directions = grid(sub);
  for (const int width : widths) {
    CAPTURE(name, width);
    const OnDevice light(emitter, width);
    const auto values = light.evaluate(directions);
    const double share = 4 * pi / static_cast<double>(directions.size());
    std::vector<double> expected(z_cells * phi_cells), observed(expected.size());
    double total = 0, irradiance = 0, luminous = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double y = luminance(values[i].sky);
      total += values[i].pdf * share;
      expected[i / (sub * sub)] += values[i].pdf * share * n;
      luminous += y * share;
      irradiance += y * share * std::max(0.0, plane(directions[i]));
      if (y > 0 && values[i].pdf == 0) FAIL("light that sampling cannot reach");
    }
    CHECK(total == Approx(1).epsilon(2e-3));  // the grid's error at the cells' bounds
    CHECK(light.record.sky_weight == Approx(luminous).epsilon(1e-2));

    double sum = 0, sum2 = 0, mean = 0, mean2 = 0;
    std::vector<Vec3> drawn;
    const auto samples = light.sample(random_numbers(n, 7), false);
    for (const auto& s : samples) {
      drawn.push_back(s.direction);
      ++observed[cell_of(s.direction)];
      const double x = luminance(s.radiance) / s.pdf, e = x * std::max(0.0, plane(s.direction));
      sum += x / n;
      sum2 += x * x / n;
      mean += e / n;
      mean2 += e * e / n;
    }
    for (double& e : expected) e /= total;
    CHECK(std::abs(chi_square_deviations(observed, expected)) < 5);
    CHECK(std::abs(mean - irradiance) < 5 * std::sqrt((mean2 - mean * mean) / n) + 5e-4 * irradiance);
    const double variance = sum2 / (sum * sum) - 1;
    CHECK(variance < variance_limit);

    // The density that a sample brings is the one smooth_pdf finds, but for directions that rounding moves across a
    // bound.
    const auto again = light.evaluate(drawn);
    std::size_t different = 0;
    for (std::size_t i = 0; i < n; ++i)
      if (std::abs(again[i].pdf / samples[i].pdf - 1) > 1e-4) ++different;
    CHECK(different < n / 1000);
  }
}

}  // namespace

// Relative variance of luminance over density: measured 0.07 %, 0.10 %, 0.03 %.
TEST_CASE("sky sampling follows its density") {
  check_sky_sampling(sunsky(60, 3, 0.5358), 0.0015, "elevation 60, turbidity 3");
  check_sky_sampling(sunsky(2, 8, 0.5358), 0.0015, "elevation 2, turbidity 8");
  Environment turned = sunsky(30, 1, 0.5358);
  turn(turned, recorded_maps[1].to_world);
  check_sky_sampling(turned, 0.0015, "turned, turbidity 1");
}

// Measured 3.8 %, 3.2 %: the cells of the table are as large as the pixels.
TEST_CASE("environment map sampling follows its density") {
  check_sky_sampling(small_envmap(), 0.05, "5 x 4 pixels");
  Environment emitter = make_environment("envmap");
  turn(emitter, recorded_maps[1].to_world);
  auto bitmap = std::make_shared<Bitmap>();
  *bitmap = {64, 32, 1, {}};
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x)
      bitmap->data.push_back(
          static_cast<float>(y < 10 ? 0 : std::exp(-0.1 * (std::pow(x - 20, 2) + std::pow(y - 15, 2)))));
  emitter.bitmap = bitmap;
  check_sky_sampling(emitter, 0.05, "64 x 32 pixels, a lamp");
}

namespace {

// Random harmonics up to this order, positive in most directions.
Environment harmonics(int order, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  Environment emitter;
  emitter.become(spherical_harmonics_model(order));
  for (Texture& coefficient : emitter.values)
    for (double& c : coefficient.value) c = normal(generator) / (1 + order);
  emitter.set("c_0_0", {4, 5, 6});
  return emitter;
}

}  // namespace

TEST_CASE("spherical harmonics are the functions of their definition") {
  const double k = std::sqrt(1 / (4 * pi));
  const auto directions = random_directions(64, 3);
  const std::vector<std::pair<const char*, double (*)(const Vec3&)>> known = {
      {"c_0_0", [](const Vec3&) { return 1.0; }},
      {"c_1_-1", [](const Vec3& d) { return std::sqrt(3.0) * d[1]; }},
      {"c_1_0", [](const Vec3& d) { return std::sqrt(3.0) * d[2]; }},
      {"c_1_1", [](const Vec3& d) { return std::sqrt(3.0) * d[0]; }},
      {"c_2_-2", [](const Vec3& d) { return std::sqrt(15.0) * d[0] * d[1]; }},
      {"c_2_0", [](const Vec3& d) { return std::sqrt(5.0) / 2 * (3 * d[2] * d[2] - 1); }},
      {"c_2_1", [](const Vec3& d) { return std::sqrt(15.0) * d[0] * d[2]; }},
      {"c_2_2", [](const Vec3& d) { return std::sqrt(15.0) / 2 * (d[0] * d[0] - d[1] * d[1]); }},
      {"c_3_-3", [](const Vec3& d) { return std::sqrt(35.0 / 8) * d[1] * (3 * d[0] * d[0] - d[1] * d[1]); }}};
  for (const auto& [name, value] : known) {
    Environment emitter;
    emitter.become(spherical_harmonics_model(3));
    emitter.set(name, {1, 0, -2});
    for (const int width : widths) {
      const auto values = OnDevice(emitter, width).evaluate(directions);
      for (std::size_t i = 0; i < values.size(); ++i) {
        CAPTURE(name, directions[i]);
        CHECK(values[i].sky[0] == Approx(k * value(directions[i])).margin(1e-6));
        CHECK(values[i].sky[2] == Approx(-2 * k * value(directions[i])).margin(2e-6));
      }
    }
  }
}

TEST_CASE("spherical harmonics are orthonormal up to order 30") {
  // Every order's sum of squares is (2 l + 1) / 4 pi in every direction (Unsoeld); random sums have their coefficients'
  // norm.
  const auto directions = grid(6);
  for (const int order : {4, 30}) {
    const Environment emitter = harmonics(order, 5);
    double norm = 0, square = 0;
    for (const Texture& c : emitter.values) norm += c.value[1] * c.value[1];
    const auto values = OnDevice(emitter, 16).evaluate(directions);
    for (const auto& value : values)
      square += value.sky[1] * value.sky[1] * 4 * pi / static_cast<double>(directions.size());
    CHECK(square == Approx(norm).epsilon(2e-3));
  }
}

// Measured 2.8 % for order 3: the brightest channel is what is sampled, and its luminance what is looked at.
TEST_CASE("sampling of spherical harmonics follows its density") {
  check_sky_sampling(harmonics(0, 1), 1e-3, "order 0");
  check_sky_sampling(harmonics(3, 2), 0.05, "order 3");
  Environment turned = harmonics(8, 3);
  turn(turned, recorded_maps[1].to_world);
  check_sky_sampling(turned, 0.05, "order 8, turned");
}

TEST_CASE("the sun is sampled uniformly over its disc") {
  for (const bool complex_sun : {false, true})
    for (const double aperture : {0.5358, 30.0})
      for (const int width : widths) {
        const Environment emitter = sunsky(12, 3, aperture, complex_sun);  // the wide one sinks into the ground
        const OnDevice light(emitter, width);
        const ClearSky sky = clear_sky(sunsky_of(emitter));
        CAPTURE(complex_sun, aperture, width);
        const double fall = 2 * std::pow(std::sin(aperture * pi / 720), 2);
        CHECK(solid_angle(light.record) == Approx(2 * pi * fall).epsilon(1e-6));

        constexpr std::size_t n = 40000;
        constexpr int rings = 10, sectors = 12;
        const auto samples = light.sample(random_numbers(n, 11), true);
        std::vector<Vec3> drawn;
        std::vector<double> observed(rings * sectors),
            expected(rings * sectors, static_cast<double>(n) / (rings * sectors));
        const Vec3& s = sky.sun;
        const double h = std::hypot(s[0], s[1]);
        const Vec3 a{-s[1] / h, s[0] / h, 0}, b{-s[2] * s[0] / h, -s[2] * s[1] / h, h};
        double power = 0;
        for (const auto& sample : samples) {
          const Vec3& d = sample.direction;
          drawn.push_back(d);
          double chord2 = 0, along_a = 0, along_b = 0;
          for (std::size_t i = 0; i < 3; ++i) {
            chord2 += std::pow(d[i] - s[i], 2);
            along_a += d[i] * a[i];
            along_b += d[i] * b[i];
          }
          const double phi = std::atan2(along_b, along_a) / (2 * pi) + 0.5;
          const int ring = std::clamp(static_cast<int>(chord2 / 2 / fall * rings), 0, rings - 1);
          ++observed[static_cast<std::size_t>(ring * sectors +
                                              std::clamp(static_cast<int>(phi * sectors), 0, sectors - 1))];
          power += luminance(sample.radiance) / light.record.sun_pdf / n;
          REQUIRE(chord2 < 2 * fall * 1.0001);
          if (std::abs(d[2]) > 1e-6 && chord2 < 2 * fall * 0.99)
            REQUIRE(difference(sample.radiance, sun_radiance(sky, d)) < 1e-3);
        }
        CHECK(std::abs(chi_square_deviations(observed, expected)) < 5);
        CHECK(power == Approx(light.record.sun_weight).epsilon(0.02));
        std::size_t outside = 0;
        for (const auto& value : light.evaluate(drawn)) outside += value.inside ? 0 : 1;
        CHECK(outside < n / 1000);  // rounding at the edge
      }
}

TEST_CASE("the sun's disc has a sharp edge") {
  const Environment emitter = sunsky(40, 3, 0.5358);
  const OnDevice light(emitter, 16);
  const ClearSky sky = clear_sky(sunsky_of(emitter));
  const Vec3& s = sky.sun;
  const double h = std::hypot(s[0], s[1]), half = sky.sun_half_angle;
  for (const double share : {0.0, 0.5, 0.999, 1.001, 1.5}) {
    const double x = std::sin(share * half), z = std::cos(share * half);
    const auto value = light.evaluate({{z * s[0] - x * s[1] / h, z * s[1] + x * s[0] / h, z * s[2]}})[0];
    CAPTURE(share);
    CHECK(value.inside == (share < 1));
    CHECK(difference(value.sun, share < 1 ? sky.sun_radiance : Rgb{0, 0, 0}) < 1e-6);
  }
}

TEST_CASE("single precision keeps the digits of sun and sky at every turbidity and elevation") {
  auto directions = random_directions(2000, 5);
  for (int i = 0; i < 200; ++i) {  // down to the horizon
    const double z = std::pow(0.96, i);
    directions.push_back({std::sqrt(1 - z * z) * std::cos(0.01 * i), std::sqrt(1 - z * z) * std::sin(0.01 * i), z});
  }
  OnDevice light(sunsky(45, 3, 20, true), 16);
  double sky_error = 0, sun_error = 0;
  std::size_t in_sun = 0;
  for (const double turbidity : {1.0, 1.7, 2.5, 4.2, 6.6, 8.9, 10.0})
    for (const double elevation : {0.05, 0.5, 2.0, 5.0, 11.0, 23.0, 47.0, 71.0, 89.9, 90.0})
      for (const double albedo : {0.0, 1.0}) {
        Environment emitter = sunsky(elevation, turbidity, 20, true);
        emitter.set("albedo", {albedo, 0.5, 1 - albedo});
        light.replace(emitter);
        const ClearSky sky = clear_sky(sunsky_of(emitter));
        const auto values = light.evaluate(directions);
        for (std::size_t i = 0; i < values.size(); ++i) {
          const Vec3& d = directions[i];
          const Vec3 rounded{static_cast<float>(d[0]), static_cast<float>(d[1]), static_cast<float>(d[2])};
          const double error = difference(values[i].sky, sky_radiance(sky, rounded));
          if (!(error <= sky_error)) sky_error = error;
          if (!values[i].inside) continue;
          ++in_sun;
          const double of_sun = difference(values[i].sun, sun_radiance(sky, rounded));
          if (!(of_sun <= sun_error)) sun_error = of_sun;
        }
      }
  CHECK(sky_error < 2e-5);
  CHECK(sun_error < 2e-5);
  CHECK(in_sun > 1000);
}

TEST_CASE("the corners of the unit square give usable directions") {
  const double last = 1 - 0x1p-24;
  const std::vector<Vec2> corners{{0, 0},   {0, last}, {last, 0},   {last, last},
                                  {0.5, 0}, {0, 0.5},  {0.5, last}, {last, 0.5}};
  Environment turned = sunsky(30, 5, 0.5358, true);
  turn(turned, recorded_maps[1].to_world);
  for (const auto& emitter : {Environment{}, small_envmap(), sunsky(90, 3, 0.5358), sunsky(0.01, 10, 60), turned})
    for (const int width : widths) {
      const OnDevice light(emitter, width);
      for (const bool of_sun : {false, true}) {
        if (of_sun && !(light.record.sun_pdf > 0)) continue;
        for (const auto& s : light.sample(corners, of_sun)) {
          CAPTURE(light.record.model, width, of_sun, s.direction, s.pdf, s.radiance);
          CHECK(std::hypot(s.direction[0], s.direction[1], s.direction[2]) == Approx(1).epsilon(1e-5));
          CHECK((s.pdf > 0 && std::isfinite(s.pdf)));
          CHECK(std::all_of(s.radiance.begin(), s.radiance.end(), [](double x) { return std::isfinite(x); }));
        }
      }
    }
}
