#include "runtime/base/parameter_chain.h"

#include <catch2/catch.hpp>

#include "runtime/scene/sky/hosek_wilkie.h"

using namespace itn;

namespace {

// All partial derivatives of a chain equal central differences, and its values those in double precision.
template <class Chain, std::size_t In>
void check_chain(const Chain& chain, const std::array<double, In>& at) {
  const auto j = jacobian(chain, at);
  CHECK(j.value == chain(at));
  for (std::size_t i = 0; i < In; ++i) {
    const double h = 1e-5 * std::max(std::abs(at[i]), 0.1);
    auto low = at, high = at;
    low[i] -= h;
    high[i] += h;
    const auto y0 = chain(low), y1 = chain(high);
    for (std::size_t o = 0; o < y0.size(); ++o) {
      INFO("output " << o << " by input " << i);
      CHECK(j.by[o][i] == Approx((y1[o] - y0[o]) / (2 * h)).epsilon(1e-7).margin(1e-9));
    }
  }
}

}  // namespace

TEST_CASE("parameter chains: dual numbers equal central differences", "[derivative]") {
  check_chain(reduced_scattering_and_absorption, std::array{0.75, 0.8, 0.3});
  check_chain(similarity, std::array{75.0, 0.8, 0.3});
  check_chain(from_log, std::array{-1.3});
  for (const double x : {-3.0, -1e-3, 0.0, 0.4, 6.0}) {
    check_chain(FromLogit{}, std::array{x});
    check_chain(FromLogit{-1, 1}, std::array{x});
  }
}

TEST_CASE("parameter chains: values at known points; far coordinates stay inside the range", "[derivative]") {
  const auto j = jacobian(reduced_scattering_and_absorption, std::array{4.0, 0.75, 0.5});
  CHECK(j.value == std::array{1.5, 1.0});
  // only the albedo moves: reduced scattering at rate sigma_t (1 - g), absorption at rate -sigma_t
  CHECK(j.by[0][1] == 2);
  CHECK(j.by[1][1] == -4);
  for (const double x : {-800.0, 800.0}) {
    const auto edge = jacobian(FromLogit{-1, 1}, std::array{x});
    CHECK(edge.value[0] == (x < 0 ? -1 : 1));
    CHECK(edge.by[0][0] == 0);
  }
}

TEST_CASE("clear sky: derivatives by turbidity, ground albedo and scales equal central differences", "[derivative]") {
  SunSky at;
  at.sun.complex = GENERATE(false, true);
  at.turbidity = GENERATE(1.3, 5.5, 9.9);
  at.albedo = {0.1, 0.5, 0.9};
  at.sun.direction = GENERATE(Vec3{0.6, 0, 0.8}, Vec3{0.3, 0.95, 0.05}, Vec3{0, 0, 1});
  at.sun_scale = 0.7;
  at.sky_scale = 1.9;
  const auto derivatives = clear_sky_derivatives(at);
  const std::array<double SunSky::*, 3> numbers{&SunSky::turbidity, &SunSky::sun_scale, &SunSky::sky_scale};
  const std::array<std::size_t, 3> number_index{SKY_TURBIDITY, SKY_SUN_SCALE, SKY_SKY_SCALE};
  double worst = 0;
  const auto compare = [&](double derivative, double low, double high, double h) {
    const double difference = (high - low) / (2 * h), rounding = 1e-15 * (std::abs(low) + std::abs(high)) / h;
    worst =
        std::max(worst, std::abs(derivative - difference) / (1e-8 * std::abs(derivative) + 100 * rounding + 1e-300));
  };
  for (std::size_t p = 0; p < SKY_PARAMETERS; ++p) {
    const double h = 1e-3;  // everything is linear between whole turbidities
    SunSky low = at, high = at;
    if (p >= SKY_ALBEDO && p < SKY_ALBEDO + 3) {
      low.albedo[p - SKY_ALBEDO] -= h;
      high.albedo[p - SKY_ALBEDO] += h;
    } else {
      for (std::size_t n = 0; n < 3; ++n)
        if (number_index[n] == p) {
          low.*numbers[n] -= h;
          high.*numbers[n] += h;
        }
    }
    const ClearSky a = clear_sky(low), b = clear_sky(high);
    const ClearSky& d = derivatives[p];
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < SKY_COEFFICIENTS; ++i) compare(d.sky[c][i], a.sky[c][i], b.sky[c][i], h);
      compare(d.sun_radiance[c], a.sun_radiance[c], b.sun_radiance[c], h);
    }
    REQUIRE(d.limb.size() == a.limb.size());
    for (std::size_t i = 0; i < a.limb.size(); ++i)
      for (std::size_t k = 0; k < 2; ++k) compare(d.limb[i][k], a.limb[i][k], b.limb[i][k], h);
    // linear in its coefficients: the sun of the derivative is the derivative of the sun
    const Rgb dim = sun_radiance(a, a.sun), bright = sun_radiance(b, b.sun), slope = sun_radiance(d, d.sun);
    for (std::size_t c = 0; c < 3; ++c) compare(slope[c], dim[c], bright[c], h);
  }
  CHECK(worst < 1);
}

TEST_CASE("clear sky: at whole turbidities the derivative is the central difference, at 1 and 10 the one inside",
          "[derivative]") {
  SunSky at;
  at.sun.direction = {0.6, 0, 0.8};
  const auto difference = [&](double low, double high) {
    SunSky a = at, b = at;
    a.turbidity = low;
    b.turbidity = high;
    return (clear_sky(b).sky[1][9] - clear_sky(a).sky[1][9]) / (high - low);
  };
  for (const double turbidity : {1.0, 3.0, 10.0}) {
    at.turbidity = turbidity;
    const double low = std::max(turbidity - 0.5, 1.0), high = std::min(turbidity + 0.5, 10.0);
    CHECK(clear_sky_derivatives(at)[SKY_TURBIDITY].sky[1][9] == Approx(difference(low, high)));
  }
  CHECK(difference(2.5, 3) != Approx(difference(3, 3.5)).epsilon(1e-3));  // there is a kink
}
