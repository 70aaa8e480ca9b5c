#include "kernels/model/microfacet.h"

#include <catch2/catch.hpp>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "beckmann_exact.h"
#include "compare.h"

using namespace itn::test;

namespace {

using Direction = Vector3<double>;
constexpr double significance = 1e-6;

Direction direction(double cosine, double azimuth) {
  const double sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

// The normal whose slope, over alpha, is (x, y).
Direction normal_of_slope(double x, double y, double alpha) {
  const double z = 1 / std::sqrt(1 + alpha * alpha * (x * x + y * y));
  return {alpha * x * z, alpha * y * z, z};
}

const LaneFunction models{{"model/microfacet.h"},
                          {"wx", "wy", "wz", "mx", "my", "mz", "alpha", "u1", "u2"},
                          {"beckmann", "ggx", "beckmann_1", "ggx_1", "bx", "by", "bz", "gx", "gy", "gz"},
                          R"(
  REAL3 wi = make3(wx, wy, wz), m = make3(mx, my, mz);
  beckmann = microfacet_visible_normals(MICROFACET_BECKMANN, wi, m, alpha);
  ggx = microfacet_visible_normals(MICROFACET_GGX, wi, m, alpha);
  beckmann_1 = microfacet_shadowing(MICROFACET_BECKMANN, wi, alpha);
  ggx_1 = microfacet_shadowing(MICROFACET_GGX, wi, alpha);
  REAL3 b = microfacet_visible_sample(MICROFACET_BECKMANN, wi, alpha, u1, u2);
  REAL3 g = microfacet_visible_sample(MICROFACET_GGX, wi, alpha, u1, u2);
  bx = b.x; by = b.y; bz = b.z; gx = g.x; gy = g.y; gz = g.z;)"};

}  // namespace

TEST_CASE("microfacets cover the surface: D has projected area 1", "[model]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double alpha = GENERATE(0.01, 0.05, 0.3, 1.0);
  // Over log(tan), which spreads the peak and the tail.
  const auto area = [&](double t, double) {
    const double slope = std::exp(t), cosine = 1 / std::sqrt(1 + slope * slope);
    const Direction m{slope * cosine, 0, cosine};
    return 2 * PI_ * microfacet_normals(distribution, m, alpha) * cosine * slope * slope * cosine * cosine * cosine;
  };
  CHECK(integrate(area, {-16, 12, 0, 1, 64, 1}, 1e-9) == Approx(1).epsilon(1e-6));
}

TEST_CASE("visible normals have density 1 in all, for Beckmann but for the fit of G1", "[model]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double alpha = GENERATE(0.05, 0.3, 1.0), cosine = GENERATE(0.02, 0.2, 0.6, 0.95, 1.0);
  const Direction wi = direction(cosine, 0.7);
  const auto density = [&](double t, double phi) {
    const double slope = std::exp(t), z = 1 / std::sqrt(1 + slope * slope);
    const Direction m{slope * z * std::cos(phi), slope * z * std::sin(phi), z};
    return microfacet_visible_normals(distribution, wi, m, alpha) * slope * slope * z * z * z;
  };
  const double total = integrate(density, {-14, 10, 0, 2 * PI_, 48, 16}, 1e-6);
  if (distribution == MICROFACET_GGX)
    CHECK(total == Approx(1).epsilon(1e-4));
  else {
    const double fit = beckmann_shadowing(wi, alpha) / beckmann_shadowing_exact(wi, alpha);
    CHECK(total == Approx(fit).epsilon(1e-4));
    CHECK(fit == Approx(1).epsilon(0.0035));
  }
}

TEST_CASE("microfacet formulas and samplers on the device match double precision", "[model]") {
  const int width = GENERATE(1, 16);
  constexpr std::size_t n = 50000;
  const auto cosine = uniform_numbers(n, 1, 0.01, 1), azimuth = uniform_numbers(n, 2, 0, 6.28);
  const auto alpha = uniform_numbers(n, 3, 0.03, 1), u1 = uniform_numbers(n, 4), u2 = uniform_numbers(n, 5);
  const auto slope_x = uniform_numbers(n, 6, -2, 2), slope_y = uniform_numbers(n, 7, -2, 2);
  Columns in(9, std::vector<float>(n));
  for (std::size_t i = 0; i < n; ++i) {
    const Direction wi = direction(cosine[i], azimuth[i]), m = normal_of_slope(slope_x[i], slope_y[i], alpha[i]);
    std::size_t k = 0;
    for (const double value : {wi.x, wi.y, wi.z, m.x, m.y, m.z}) in[k++][i] = static_cast<float>(value);
  }
  in[6] = alpha;
  in[7] = u1;
  in[8] = u2;
  const Columns out = run_lanes(models, width, in);
  const auto wi = [&](auto i) { return Direction{in[0][i], in[1][i], in[2][i]}; };
  const auto m = [&](auto i) { return Direction{in[3][i], in[4][i], in[5][i]}; };
  for (const int d : {MICROFACET_BECKMANN, MICROFACET_GGX}) {
    const auto k = static_cast<std::size_t>(d);
    CHECK(largest_error(out[k], 1e-2,
                        [&](auto i) { return microfacet_visible_normals<double>(d, wi(i), m(i), alpha[i]); }) < 1e-4);
    CHECK(largest_error(out[2 + k], 0, [&](auto i) { return microfacet_shadowing<double>(d, wi(i), alpha[i]); }) <
          1e-6);
    const auto sample = [&](auto i) { return microfacet_visible_sample<double>(d, wi(i), alpha[i], u1[i], u2[i]); };
    // GGX: a direction at the very bottom of the cap loses digits; Beckmann: where the distribution is flat.
    const double bound = d == MICROFACET_GGX ? 5e-5 : 2e-4;
    CHECK(largest_error(out[4 + 3 * k], 1, [&](auto i) { return sample(i).x; }) < bound);
    CHECK(largest_error(out[5 + 3 * k], 1, [&](auto i) { return sample(i).y; }) < bound);
    CHECK(largest_error(out[6 + 3 * k], 1, [&](auto i) { return sample(i).z; }) < bound);
  }
}

TEST_CASE("the fits behind Beckmann's sampler keep their error bounds", "[model]") {
  double worst = 0;
  for (int i = 0; i <= 450; ++i) {
    const double x = 0.01 * i;
    worst = std::max(worst, std::abs(erfc_scaled(x) / (std::exp(x * x) * std::erfc(x)) - 1));
  }
  CHECK(worst < 4e-7);
  double worst_quantile = 0;
  for (const float u : uniform_numbers(10000, 8)) {
    const double x = normal_quantile<double>(u);
    const double slope = 2 / std::sqrt(PI_) * std::exp(-x * x);  // of erfc
    worst_quantile = std::max(worst_quantile, std::abs(std::erfc(x) - 2 * u) / (slope * std::abs(x)));
  }
  CHECK(worst_quantile < 4e-5);
}

TEST_CASE("Beckmann's sampler inverts the distribution of visible slopes", "[model]") {
  const double alpha = 0.4;
  const auto above = [](double q, double k) {
    return 0.5 * k * std::sqrt(PI_) * std::erfc(q) + 0.5 * std::exp(-q * q);
  };
  double worst = 0, worst_end = 0;
  for (const double cosine : {1e-6, 0.003, 0.03, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 0.95, 0.999, 0.999999}) {
    const Direction wi = direction(cosine, 0);
    const double k = wi.z / (alpha * wi.x);
    for (int i = 0; i < 400; ++i) {
      const double u = (i + 0.5) / 400;
      for (const double u1 : {u, std::exp2(-23 * u), 1 - std::exp2(-23 * u)}) {
        const Direction m = beckmann_visible_sample(wi, alpha, u1, 0.5);
        const double error = std::abs(above(m.x / m.z / alpha, k) / above(-k, k) - u1);
        (u1 < 0.998 ? worst : worst_end) = std::max(u1 < 0.998 ? worst : worst_end, error);
      }
    }
  }
  CHECK(worst < 2e-6);
  CHECK(worst_end < 1e-5);
}

TEST_CASE("sampled normals follow the density of visible normals (chi-square)", "[model][stat]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double alpha = GENERATE(0.02, 0.3, 1.0), cosine = GENERATE(0.003, 0.05, 0.3, 0.8, 1.0);
  constexpr std::size_t n = 1 << 17;
  const Direction exact = direction(cosine, 2.1);
  const Direction wi{static_cast<float>(exact.x), static_cast<float>(exact.y), static_cast<float>(exact.z)};
  Columns in{9, std::vector<float>(n)};
  std::size_t k = 0;
  for (const double value : {wi.x, wi.y, wi.z, 0.0, 0.0, 1.0, alpha}) in[k++].assign(n, static_cast<float>(value));
  in[7] = uniform_numbers(n, 9);
  in[8] = uniform_numbers(n, 10);
  const Columns out = run_lanes(models, 16, in);
  const std::size_t first = distribution == MICROFACET_GGX ? 7 : 4;
  CHECK(*std::min_element(out[first + 2].begin(), out[first + 2].end()) > 0);
  std::vector<Point> slopes;
  for (std::size_t i = 0; i < n; ++i) {
    const double per = 1 / (alpha * out[first + 2][i]);
    slopes.push_back({out[first][i] * per, out[first + 1][i] * per});
  }
  const double fit =
      distribution == MICROFACET_GGX ? 1 : beckmann_shadowing(wi, alpha) / beckmann_shadowing_exact(wi, alpha);
  const auto density = [&](double x, double y) {
    const Direction m = normal_of_slope(x, y, alpha);
    return microfacet_visible_normals(distribution, wi, m, alpha) * m.z * m.z * m.z * alpha * alpha / fit;
  };
  const ChiSquare result = chi_square(slopes, density, {-4, 4, -4, 4, 48, 48});
  INFO("distribution " << distribution << ", alpha " << alpha << ", cosine " << cosine << ", chi-square "
                       << result.statistic << ", degrees of freedom " << result.degrees_of_freedom);
  CHECK(result.p_value > significance);
}
