// Tables that the host makes of a scene's light, without a device.
#include "runtime/render/compile/environment.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "itn/error.h"
#include "kernels/model/angle.h"
#include "kernels/model/sky_hosek_wilkie.h"
#include "runtime/scene/sky/hosek_wilkie.h"

namespace {

using namespace itn;
constexpr double pi = std::numbers::pi;
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

Environment sunsky() {
  Environment emitter = make_environment("sunsky");
  emitter.where = {"light.xml", 12, 5};
  emitter.sun.direction = {0.6, 0, 0.8};
  return emitter;
}

Environment envmap(int width, int height, float value) {
  Environment emitter = make_environment("envmap");
  emitter.where = {"light.xml", 12, 5};
  auto bitmap = std::make_shared<Bitmap>();
  *bitmap = {width, height, 1, std::vector<float>(static_cast<std::size_t>(width * height), value)};
  emitter.bitmap = bitmap;
  return emitter;
}

Environment envmap_with(double value) {
  Environment emitter = envmap(6, 4, 1);
  auto bitmap = std::make_shared<Bitmap>(*emitter.bitmap);
  bitmap->data[6 * 2 + 3] = static_cast<float>(value);
  emitter.bitmap = bitmap;
  return emitter;
}

std::string refusal(const Environment& emitter) {
  EnvironmentRecord record;
  std::vector<float> tables;
  try {
    append_environment(emitter, record, tables);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::string refusal(void (*change)(Environment&)) {
  Environment emitter = sunsky();
  change(emitter);
  return refusal(emitter);
}

}  // namespace

TEST_CASE("a sunsky out of its range is refused with place, value and range") {
  using Catch::Contains;
  REQUIRE(refusal(sunsky()) == "accepted");
  CHECK(refusal([](Environment& s) { s.set("turbidity", 10.5); }) ==
        "light.xml:12:5: turbidity of the sunsky emitter must be in [1, 10]; got 10.5");
  CHECK_THAT(refusal([](Environment& s) { s.set("turbidity", 0.9); }), Contains("[1, 10]; got 0.9"));
  CHECK_THAT(refusal([](Environment& s) { s.set("turbidity", not_a_number); }), Contains("got nan"));
  CHECK_THAT(refusal([](Environment& s) {
               s.set("albedo", {0.3, 1.5, 0.3});
             }),
             Contains("albedo") && Contains("[0, 1]; got 1.5"));
  CHECK_THAT(refusal([](Environment& s) { s.set("sun_scale", -1); }), Contains("sun_scale") && Contains("got -1"));
  CHECK_THAT(refusal([](Environment& s) { s.set("sky_scale", not_a_number); }), Contains("sky_scale"));
  CHECK_THAT(refusal([](Environment& s) { s.sun.aperture = 0; }), Contains("sun_aperture") && Contains("90"));
  CHECK_THAT(refusal([](Environment& s) { s.sun.aperture = 90; }), Contains("sun_aperture"));
  CHECK_THAT(refusal([](Environment& s) { s.sun.direction = {0, 0, 0}; }), Contains("sun_direction"));
  CHECK_THAT(refusal([](Environment& s) { s.sun.direction = {1, 0, -0.1}; }), Contains("above the horizon"));
  CHECK_THAT(refusal([](Environment& s) { s.sun.direction = {1, 0, 0}; }), Contains("above the horizon"));
  CHECK(refusal([](Environment& s) {
          s.set("sun_scale", 0);
          s.set("sky_scale", 0);
        }) == "accepted");
}

TEST_CASE("an environment map that cannot light a scene is refused") {
  using Catch::Contains;
  REQUIRE(refusal(envmap(6, 4, 1)) == "accepted");
  CHECK(refusal(envmap(6, 4, 0)) == "accepted");  // darkness is fine
  Environment none = envmap(6, 4, 1);
  none.bitmap = nullptr;
  CHECK_THAT(refusal(none), Contains("light.xml:12:5: bitmap of the envmap emitter") && Contains("none"));
  CHECK_THAT(refusal(envmap(0, 0, 1)), Contains("2 x 3") && Contains("0 x 0"));
  CHECK_THAT(refusal(envmap(1, 1, 1)), Contains("constant emitter"));
  CHECK_THAT(refusal(envmap_with(-2)), Contains("got -2 at column 3, row 2"));
  CHECK_THAT(refusal(envmap_with(not_a_number)), Contains("got nan at column 3, row 2"));
  CHECK_THAT(refusal(envmap_with(std::numeric_limits<double>::infinity())), Contains("got inf at column 3, row 2"));
  Environment scaled = envmap(6, 4, 1e30f);
  scaled.set("scale", 1e30);
  CHECK_THAT(refusal(scaled), Contains("lower the scale"));
  scaled.set("scale", -1);
  CHECK_THAT(refusal(scaled), Contains("scale of the envmap emitter") && Contains("got -1"));
}

TEST_CASE("constant light must be a finite amount") {
  Environment emitter;
  CHECK(refusal(emitter) == "accepted");
  emitter.set("radiance", {1, 1, -0.5});
  CHECK_THAT(refusal(emitter), Catch::Contains("radiance") && Catch::Contains("got -0.5"));
  emitter.set("radiance", {1, 1, not_a_number});
  CHECK_THAT(refusal(emitter), Catch::Contains("got nan"));
}

TEST_CASE("to_world of light may turn and mirror, not scale") {
  Environment emitter = envmap(6, 4, 1);
  emitter.to_world.m[0] = -1;
  emitter.to_world.m[3] = 7;  // a shift does nothing
  CHECK(refusal(emitter) == "accepted");
  emitter.to_world.m[5] = 2;
  CHECK_THAT(refusal(emitter), Catch::Contains("to_world") && Catch::Contains("remove the scale"));
  emitter.to_world.m[5] = not_a_number;
  CHECK_THAT(refusal(emitter), Catch::Contains("to_world"));
}

TEST_CASE("several emitters share one array of tables") {
  EnvironmentRecord alone, first, second;
  std::vector<float> tables, own;
  append_environment(sunsky(), first, tables);
  const std::size_t used = tables.size();
  append_environment(envmap(6, 4, 1), second, tables);
  append_environment(envmap(6, 4, 1), alone, own);
  REQUIRE(second.values == alone.values + static_cast<int>(used));
  REQUIRE(second.sampling == alone.sampling + static_cast<int>(used));
  CHECK(std::vector<float>(tables.begin() + static_cast<std::ptrdiff_t>(used), tables.end()) == own);
}

TEST_CASE("a sampling table reaches every cell that gives light, however little") {
  EnvironmentRecord record;
  std::vector<float> tables;
  Environment emitter = envmap(64, 32, 1e-20f);
  auto bitmap = std::make_shared<Bitmap>(*emitter.bitmap);
  bitmap->data[100] = 1e6f;
  emitter.bitmap = bitmap;
  append_environment(emitter, record, tables);
  const auto check = [&](int at, int n) {
    CHECK(tables[static_cast<std::size_t>(at)] == 0);
    CHECK(tables[static_cast<std::size_t>(at + n)] == 1);
    for (int i = 0; i < n; ++i) {
      const double low = tables[static_cast<std::size_t>(at + i)], high = tables[static_cast<std::size_t>(at + i + 1)];
      REQUIRE(high - low >= 0x1p-24);
      REQUIRE(low * 0x1p24 == std::floor(low * 0x1p24));
    }
  };
  check(record.sampling, 31);
  for (int row = 0; row < 31; ++row) check(record.sampling + 32 + row * 65, 64);
}

TEST_CASE("the angle of a point is its arc tangent") {
  for (int i = -180; i <= 180; ++i) {
    const double expected = i * pi / 180;
    const double angle = angle_of(3 * std::sin(expected), 3 * std::cos(expected));
    REQUIRE(std::abs(angle - expected) <= 1e-9 * std::abs(expected) + 1e-15);
  }
  CHECK(angle_of(0.0, 0.0) == 0);
  const double tiny = 1e-9;
  CHECK(angle_between(Vector3<double>{1, 0, 0}, Vector3<double>{std::cos(tiny), std::sin(tiny), 0}) ==
        Approx(tiny).epsilon(1e-8));
}

TEST_CASE("exp(x) - 1 keeps its digits") {
  for (double x = -20; x < 10; x += 0.01) REQUIRE(exp_minus_one(x) == Approx(std::expm1(x)).epsilon(1e-9));
  CHECK(exp_minus_one(1e-12) == Approx(1e-12).epsilon(1e-12));
}

TEST_CASE("the sky's formula is the published one") {
  // A to H of a green channel at turbidity 3; I and H in the order of the tables
  const double k[] = {-1.14, -0.2, -7.5, 8.4, -0.057, 0.9, 0.034, 4.8, 0.51, 7.0};
  for (double theta = 0; theta < pi / 2; theta += 0.1)
    for (double gamma = 0; gamma < pi; gamma += 0.1) {
      const double z = std::cos(theta), c = std::cos(gamma);
      const double chi = (1 + c * c) / std::pow(1 + k[8] * k[8] - 2 * k[8] * c, 1.5);
      const double expected = k[9] * (1 + k[0] * std::exp(k[1] / (z + 0.01))) *
                              (k[2] + k[3] * std::exp(k[4] * gamma) + k[5] * c * c + k[6] * chi + k[7] * std::sqrt(z));
      REQUIRE(sky_hosek_wilkie(k, z, gamma, 1 - c) == Approx(expected).epsilon(1e-9));
    }
}
