// Derivatives of the light's radiance, direction by direction, as kernels compute them: against differences in double
// precision.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include "itn/device.h"
#include "itn/parameters.h"
#include "runtime/render/compile/environment.h"
#include "runtime/render/compile/surfaces.h"
#include "runtime/render/derivative/score_functions.h"
#include "runtime/scene/model/sized_model.h"
#include "runtime/scene/sky/hosek_wilkie.h"
#include "tests/support/plain_program.h"

using namespace itn;

namespace {

const Device& device() {
  static const Device shared;
  return shared;
}

struct Values {
  Rgb radiance, derivative;
};

std::vector<Values> on_device(const Environment& emitter, const Parameter& p, const std::vector<Vec3>& directions,
                              int width) {
  std::vector<float> tables;
  std::vector<EnvironmentRecord> records(2);
  append_environment(emitter, records[0], tables);
  records[1] = environment_derivative(emitter, p, records[0], tables);
  LaunchData launch;
  launch.environments = records;
  const auto definitions = test::plain_program(
      launch, width, {{"LIGHT_SAMPLING", "1"}, {"RADIANCE_CHANNELS", "3"}, {"HAS_LIGHT_DERIVATIVES", "1"}});
  setenv("ITN_KERNEL_DIR", ITN_SOURCE_DIR "/tests/derivative", 1);
  const cl::Program program =
      device().build("emission_test.cl", definitions,
                     {{"program/scores.h", print_scores({{"derivative_sky_hosek_wilkie", {0}}}, 3)},
                      {"program/surfaces.h", surfaces_text(launch)}});
  unsetenv("ITN_KERNEL_DIR");
  const std::size_t n = directions.size();
  std::vector<float> in(3 * n), out(6 * n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < 3; ++k) in[k * n + i] = static_cast<float>(directions[i][k]);
  const cl::Buffer on_records = device().upload(records, "records"), on_tables = device().upload(tables, "tables"),
                   from = device().upload(in, "in"), to = device().upload(out, "out");
  cl::Kernel kernel(program, "differentiate");
  kernel.setArg(0, on_records);
  kernel.setArg(1, on_tables);
  kernel.setArg(2, from);
  kernel.setArg(3, to);
  device().launch(kernel, n / static_cast<std::size_t>(width), 1);
  device().finish();
  device().download(to, out);
  std::vector<Values> values(n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      values[i].radiance[c] = static_cast<double>(out[c * n + i]);
      values[i].derivative[c] = static_cast<double>(out[(3 + c) * n + i]);
    }
  return values;
}

Vec3 unit(const Vec3& v) {
  const double length = std::hypot(v[0], v[1], v[2]);
  return {v[0] / length, v[1] / length, v[2] / length};
}

// All around, and half of them within the cone of `half_angle` about an axis.
std::vector<Vec3> directions_about(const Vec3& axis, double half_angle) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  std::vector<Vec3> directions(1024);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    Vec3 d = unit({normal(random), normal(random), normal(random)});
    if (i % 2)
      for (std::size_t k = 0; k < 3; ++k) d[k] = axis[k] + 0.7 * half_angle * d[k];
    directions[i] = unit(d);
  }
  return directions;
}

Scene lit_by(const Environment& emitter) {
  Scene scene;
  scene.environment = emitter;
  scene.environment->id = "light";
  return scene;
}

Environment moved(const Environment& emitter, const Parameter& p, double by) {
  Scene scene = lit_by(emitter);
  set_parameter(scene, p, p.value + by);
  return *scene.environment;
}

// In a world whose z is up.
Rgb clear_sky_radiance(const Environment& emitter, const Vec3& direction) {
  const ClearSky sky = clear_sky(sunsky_of(emitter));
  const Rgb around = sky_radiance(sky, direction), sun = sun_radiance(sky, direction);
  return {around[0] + sun[0], around[1] + sun[1], around[2] + sun[2]};
}

}  // namespace

TEST_CASE("the derivative of sun and sky in any direction is that of differences in double precision", "[derivative]") {
  Environment emitter = make_environment("sunsky");
  Sun& sun = emitter.sun;
  sun.complex = GENERATE(false, true);
  const bool grey = GENERATE(false, true);
  emitter.set("turbidity", 2.4);
  emitter.set("albedo", grey ? Rgb{0.4, 0.4, 0.4} : Rgb{0.2, 0.5, 0.7});
  emitter.set("sun_scale", 0.8);
  emitter.set("sky_scale", 1.7);
  sun.aperture = 8;
  sun.direction = unit({0.5, -0.3, 0.6});
  const double half_angle = sun.aperture / 2 * std::numbers::pi / 180;
  const auto directions = directions_about(sun.direction, half_angle);
  const auto parameters = list_parameters(lit_by(emitter));
  CHECK(parameters.size() == (grey ? 4 : 6));
  for (const Parameter& p : parameters) {
    // Radiance is smooth between whole turbidities: what is left of the difference's error is below 1e-8.
    const double h = 1e-3;
    const Environment low = moved(emitter, p, -h), high = moved(emitter, p, h);
    for (const int width : {1, 16}) {
      const auto values = on_device(emitter, p, directions, width);
      std::size_t wrong = 0, in_sun = 0, dark = 0;
      double largest = 0;
      for (std::size_t i = 0; i < directions.size(); ++i) {
        const Vec3& d = directions[i];
        const double chord = std::hypot(d[0] - sun.direction[0], d[1] - sun.direction[1], d[2] - sun.direction[2]);
        if (std::abs(chord - 2 * std::sin(half_angle / 2)) < 1e-6 || std::abs(d[2]) < 1e-6) continue;
        in_sun += chord < half_angle;
        dark += d[2] < 0;
        const Rgb at = clear_sky_radiance(emitter, d), a = clear_sky_radiance(low, d), b = clear_sky_radiance(high, d);
        for (std::size_t c = 0; c < 3; ++c) {
          const double expected = (b[c] - a[c]) / (2 * h);
          largest = std::max(largest, std::abs(expected));
          // Single precision, of numbers as large as the radiance.
          wrong += !(std::abs(values[i].derivative[c] - expected) <= 2e-5 * (std::abs(expected) + std::abs(at[c])));
          wrong += !(std::abs(values[i].radiance[c] - at[c]) <= 2e-5 * std::abs(at[c]) + 1e-6);
        }
      }
      INFO(p.name << ", width " << width << ", limb darkening " << sun.complex);
      CHECK(wrong == 0);
      CHECK(in_sun > 300);
      CHECK(dark > 200);
      CHECK(largest > 0.01);
    }
  }
}

TEST_CASE("the derivative of constant light and of an environment map is their radiance at a value of 1",
          "[derivative]") {
  const bool map = GENERATE(false, true);
  Environment emitter;
  if (map) {
    emitter = make_environment("envmap");
    auto bitmap = std::make_shared<Bitmap>();
    bitmap->width = 8;
    bitmap->height = 5;
    for (int i = 0; i < 8 * 5 * 3; ++i) bitmap->data.push_back(static_cast<float>(i * i % 37));
    emitter.bitmap = bitmap;
    emitter.set("scale", GENERATE(0.0, 0.3));
  } else {
    emitter.set("radiance", GENERATE(Rgb{0, 0, 0}, Rgb{0.2, 0.2, 0.2}, Rgb{0.2, 0, 3}));
  }
  const auto directions = directions_about({0, 1, 0}, 0.5);
  for (const Parameter& p : list_parameters(lit_by(emitter))) {
    Environment of_one = emitter;
    if (p.has_values()) {
      auto bitmap = std::make_shared<Bitmap>(*emitter.bitmap);
      std::fill(bitmap->data.begin(), bitmap->data.end(), 1.0F);
      of_one.bitmap = bitmap;
    } else {
      of_one = moved(emitter, p, 1 - p.value);
    }
    const auto ones = on_device(of_one, p, directions, 16);
    const auto values = on_device(emitter, p, directions, 16);
    const double rounding = p.has_values() ? 3e-7 : 0;  // of weights that are one together
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < directions.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        const auto k = static_cast<std::size_t>(c);
        const double expected = p.component < 0 || p.component == c ? ones[i].radiance[k] : 0;
        wrong += !(std::abs(values[i].derivative[k] - expected) <= rounding);
      }
    INFO(p.name << " = " << p.value);
    CHECK(wrong == 0);
  }
}

TEST_CASE("the derivative by a coefficient of spherical harmonics is what radiance grows by with it", "[derivative]") {
  Environment emitter;
  emitter.become(spherical_harmonics_model(3));
  emitter.set("c_0_0", Rgb{1, 2, 3});
  emitter.set("c_2_-1", 0.25);
  const auto directions = directions_about({0, 1, 0}, 0.5);
  const auto parameters = list_parameters(lit_by(emitter));
  CHECK(parameters.size() == 15 + 3);
  for (const Parameter& p : parameters) {
    const auto values = on_device(emitter, p, directions, 16),
               more = on_device(moved(emitter, p, 1), p, directions, 16);
    double worst = 0, largest = 0;
    for (std::size_t i = 0; i < directions.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        worst = std::max(worst, std::abs(values[i].derivative[c] - (more[i].radiance[c] - values[i].radiance[c])));
        largest = std::max(largest, std::abs(values[i].derivative[c]));
      }
    INFO(p.name);
    CHECK(worst < 2e-6);
    CHECK(largest > 0.2);
  }
}
