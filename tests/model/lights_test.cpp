// The lights of kernels/model/light/list.h: what reaches a point is linear in the colour and, where a light has a
// power, adds up to it.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "../support/chi_square.h"
#include "itn/model.h"
#include "itn/scene.h"
#include "kernels/shared/declaration.h"
#include "runtime/scene/transform.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double pi = std::numbers::pi;

Light light_of(const std::string& type) {
  Light light;
  light.become(*find_model(light_models(), type));
  return light;
}

Arrival arrival(const Light& light, const Vec3& from, const Vec3& on = {}, const Vec3& normal = {}) {
  return light.model->arrives(light.model->to_numbers(light.variant, light.slots()), from, on, normal);
}

// The power through a sphere of that radius about the light's position, for a colour of 1.
double power(const Light& light, const Vec3& position, double radius) {
  const auto through = [&](double z, double phi) {
    const double r = std::sqrt(1 - z * z);
    const Vec3 out{r * std::cos(phi), r * std::sin(phi), z};
    const Arrival a = arrival(light, position + radius * out);
    CHECK(a.distance == Approx(radius).epsilon(1e-9));
    CHECK(length(Vec3{a.towards} + out) == Approx(0).margin(1e-9));
    return a.share * radius * radius;
  };
  return integrate(through, {-1, 1, 0, 2 * pi, 64, 4}, 1e-7);
}

}  // namespace

TEST_CASE("every light's first three numbers are its colour, and nothing else moves them", "[model]") {
  for (const Model& model : light_models()) {
    CAPTURE(model.name);
    REQUIRE(model.numbers.front().slot == 0);
    REQUIRE(model.numbers.front().channels == 3);
    Light light;
    light.become(model);
    light.values.front().value = {0.25, 0.5, 2};
    const std::vector<double> n = model.to_numbers(0, light.slots());
    const DeclaredParameter& colour = model.parameters.front();
    const bool grey = colour.kind.channels == 1;  // one number for all three
    CHECK(std::vector<double>(n.begin(), n.begin() + 3) ==
          (grey ? std::vector<double>(3, 0.25) : std::vector<double>{0.25, 0.5, 2}));
    const auto by = model.jacobian(0, light.slots());
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t p = 0; p < by[c].size(); ++p) CHECK(by[c][p] == (p == (grey ? 0 : c) ? 1 : 0));
  }
}

TEST_CASE("a point sends out 4 pi of its intensity at any distance", "[model]") {
  Light light = light_of("point");
  light.value("position").value = {1, -2, 0.5};
  for (const double radius : {0.01, 1.0, 300.0})
    CHECK(power(light, {1, -2, 0.5}, radius) == Approx(4 * pi).epsilon(1e-6));
}

// Integral of 2 pi sin(a) min(1, (c - a) / (c - b)) over the angles a up to the cutoff c.
TEST_CASE("a spot sends out the integral of its profile, about its axis alone", "[model]") {
  for (const auto& [cutoff, beam] : {std::pair{20.0, 15.0}, {60.0, 0.0}, {90.0, 60.0}, {30.0, 30.0}}) {
    CAPTURE(cutoff, beam);
    Light light = light_of("spot");
    light.value("axis").value = {0, 0, 1};
    light.set("cutoff_angle", cutoff);
    light.set("beam_width", beam);
    const double c = cutoff * pi / 180, b = beam * pi / 180;
    const double edge = c > b ? (std::sin(b) - std::sin(c)) / (c - b) + std::cos(b) : std::cos(b);
    CHECK(power(light, {0, 0, 0}, 2) ==
          Approx(2 * pi * (1 - std::cos(b) + edge - (c > b ? 0 : std::cos(b)))).epsilon(1e-3));
    CHECK(arrival(light, {0, 0, 2}).share == Approx(0.25));
    CHECK(arrival(light, {0, 0, -2}).share == 0);
  }
}

TEST_CASE("a projector's picture covers its field of view, and is as bright everywhere on a wall at right angles") {
  Light light = light_of("projector");
  light.value("left").value = {1, 0, 0};
  light.value("up").value = {0, 1, 0};
  light.value("axis").value = {0, 0, 1};
  light.set("fov", 90);
  light.set("aspect", 2);
  for (const Vec3& on : {Vec3{0, 0, 3}, Vec3{2.9, 0, 3}, Vec3{-2.9, 1.4, 3}}) {
    const Arrival a = arrival(light, on);
    const double cosine = 3 / a.distance;  // at the wall
    CHECK(a.share * cosine == Approx(pi / 9).epsilon(1e-9));
    CHECK(a.uv[0] == Approx(0.5 - on[0] / 6));
    CHECK(a.uv[1] == Approx(0.5 - on[1] / 3));
  }
  for (const Vec3& dark : {Vec3{3.1, 0, 3}, Vec3{0, 1.6, 3}, Vec3{0, 0, -3}}) CHECK(arrival(light, dark).share == 0);
}

TEST_CASE("directional light arrives alike everywhere, against its direction, from beyond every scene", "[model]") {
  Light light = light_of("directional");
  light.value("direction").value = {0.6, 0, -0.8};
  for (const Vec3& from : {Vec3{0, 0, 0}, Vec3{100, -3, 2}}) {
    const Arrival a = arrival(light, from);
    CHECK(a.share == 1);
    CHECK(a.distance >= static_cast<double>(FAR_AWAY));
    CHECK(Vec3{a.towards} == Vec3{-0.6, 0, 0.8});
  }
}

TEST_CASE("a beam is as bright everywhere in front of its shape, and dark beside and behind it", "[model]") {
  Light light = light_of("directionalarea");
  light.value("center").value = {1, 0, 0};
  light.value("normal").value = {0, 0, 1};
  light.value("to_u").value = {0.5, 0, 0};  // 2 wide to either side, 1 high
  light.value("to_v").value = {0, 1, 0};
  for (const bool round : {false, true}) {
    light.set("round", round ? 1 : 0);
    for (const Vec3& from : {Vec3{1, 0, 0.1}, Vec3{2.5, 0, 50}, Vec3{1, -0.9, 3}}) {
      const Arrival a = arrival(light, from);
      CHECK(a.share == 1);
      CHECK(a.distance == Approx(from[2]));
      CHECK(Vec3{a.towards} == Vec3{0, 0, -1});
    }
    for (const Vec3& dark : {Vec3{1, 0, -2}, Vec3{3.1, 0, 1}, Vec3{1, 1.1, 1}}) CHECK(arrival(light, dark).share == 0);
    CHECK(arrival(light, {2.8, 0.9, 1}).share == (round ? 0 : 1));  // in a corner
  }
}

TEST_CASE("a shape shines to the front, and not to the back", "[model]") {
  const Light light = light_of("area");
  const Vec3 on{0, 0, 1}, normal{0, 0, 1};
  CHECK(arrival(light, {0.5, 0, 3}, on, normal).share == 1);
  CHECK(arrival(light, {0.5, 0, -3}, on, normal).share == 0);
  CHECK(arrival(light, {0, 0, 4}, on, normal).distance == Approx(3));
}
