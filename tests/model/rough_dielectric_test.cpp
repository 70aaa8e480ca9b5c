#include "kernels/model/bsdf/rough_dielectric.h"

#include <catch2/catch.hpp>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "beckmann_exact.h"
#include "compare.h"

using namespace itn::test;

namespace {

using Direction = Vector3<double>;
constexpr double significance = 1e-6;

const LaneFunction model{{"model/bsdf/rough_dielectric.h"},
                         {"distribution", "alpha", "eta", "wx", "wy", "wz", "u0", "u1", "u2"},
                         {"x", "y", "z", "weight", "pdf", "reflected", "eval", "pdf_again"},
                         R"(
  Lanes d;
  d.real = distribution;
  int kind = (int)d.f[0];
  REAL3 wi = make3(wx, wy, wz), wo;
  MASK mirror;
  rough_dielectric_sample(kind, alpha, eta, wi, u0, u1, u2, &wo, &weight, &pdf, &mirror);
  x = wo.x; y = wo.y; z = wo.z;
  reflected = SELECT(mirror, 1.0f, 0.0f);
  eval = rough_dielectric_eval(kind, alpha, eta, wi, wo);
  pdf_again = rough_dielectric_pdf(kind, alpha, eta, wi, wo);)"};

Direction direction(double cosine, double azimuth) {
  const double sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

struct Sample {
  Direction wo{};
  double weight = 0, pdf = 0;
  bool reflected = false;
};

Sample sample(int distribution, double alpha, double eta, const Direction& wi, double u0, double u1, double u2) {
  Sample s;
  rough_dielectric_sample(distribution, alpha, eta, wi, u0, u1, u2, &s.wo, &s.weight, &s.pdf, &s.reflected);
  return s;
}

// Integral over the sphere of the value, transmitted radiance as power (times eta^2).
double transmitted_and_reflected(int distribution, double alpha, double eta, const Direction& wi) {
  const auto power = [&](double theta, double phi) {
    const Direction wo{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
    const double scale = wo.z * wi.z > 0 ? 1 : eta * eta;
    return rough_dielectric_eval(distribution, alpha, eta, wi, wo) * scale * std::sin(theta);
  };
  return integrate(power, {0, PI_, 0, 2 * PI_, 32, 32}, 1e-4);
}

}  // namespace

// Mitsuba 3.9.1, variant scalar_rgb, BSDF::eval and BSDF::pdf of
//   <bsdf type="roughdielectric"> distribution, alpha, int_ior = n, ext_ior = 1 </bsdf>
// at directions drawn by its own sample(); made by rough_dielectric_mitsuba.py.
TEST_CASE("rough dielectric: value and density equal Mitsuba's", "[model]") {
  struct Row {
    int distribution;
    double alpha, n;
    Direction wi, wo;
    double value, pdf;
  };
  const std::vector<Row> rows{
#include "rough_dielectric_mitsuba.inc"
  };
  double worst = 0;
  for (const auto& r : rows) {
    const double eta = r.wi.z > 0 ? r.n : 1 / r.n;
    worst =
        std::max({worst, std::abs(rough_dielectric_eval(r.distribution, r.alpha, eta, r.wi, r.wo) - r.value) / r.value,
                  std::abs(rough_dielectric_pdf(r.distribution, r.alpha, eta, r.wi, r.wo) - r.pdf) / r.pdf});
  }
  CHECK(rows.size() == 64);
  CHECK(worst < 1e-5);  // Mitsuba computes in single precision
}

TEST_CASE("rough dielectric: a sample's weight is value over density", "[model]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double alpha = GENERATE(0.05, 0.3, 1.0), eta = GENERATE(1 / 1.5, 1.33);
  const auto u = uniform_numbers(15000, 1), cosine = uniform_numbers(3000, 2, -1, 1);
  double worst = 0;
  int used = 0;
  for (std::size_t i = 0; i < cosine.size(); ++i) {
    const Direction wi = direction(cosine[i], 6.28 * u[5 * i]);
    const Sample s = sample(distribution, alpha, eta, wi, u[5 * i + 1], u[5 * i + 2], u[5 * i + 3]);
    const double value = rough_dielectric_eval(distribution, alpha, eta, wi, s.wo);
    const double pdf = rough_dielectric_pdf(distribution, alpha, eta, wi, s.wo);
    if (s.weight == 0) {
      worst = std::max(worst, s.pdf);
      continue;
    }
    ++used;
    worst = std::max({worst, std::abs(s.weight * pdf / value - 1), std::abs(s.pdf / pdf - 1)});
  }
  CHECK(used > 2000);
  CHECK(worst < 1e-8);
}

TEST_CASE("rough dielectric is reciprocal: eta^2 f(wi, wo) = f(wo, wi) for transmission, f for reflection", "[model]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double eta = GENERATE(1 / 1.5, 1.33), alpha = 0.4;
  const auto u = uniform_numbers(12000, 3);
  double worst = 0;
  int transmitted = 0;
  for (std::size_t i = 0; i < 12000; i += 4) {
    const Direction wi = direction(2 * u[i] - 1, 1.0);
    const Direction wo = sample(distribution, alpha, eta, wi, u[i + 1], u[i + 2], u[i + 3]).wo;
    const bool through = wi.z * wo.z < 0;
    const double there = rough_dielectric_eval(distribution, alpha, eta, wi, wo) / std::abs(wo.z);
    const double back = rough_dielectric_eval(distribution, alpha, through ? 1 / eta : eta, wo, wi) / std::abs(wi.z);
    if (there == 0) continue;
    transmitted += through;
    worst = std::max(worst, std::abs(there * (through ? eta * eta : 1) / back - 1));
  }
  CHECK(transmitted > 500);
  CHECK(worst < 1e-8);
}

TEST_CASE("rough dielectric creates no energy, and loses none where shadowing is absent", "[model]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double alpha = GENERATE(0.1, 0.3, 1.0), eta = GENERATE(1 / 1.5, 1.5), cosine = GENERATE(0.1, 0.5, 1.0);
  const double sum = transmitted_and_reflected(distribution, alpha, eta, direction(cosine, 0.3));
  INFO("distribution " << distribution << ", alpha " << alpha << ", eta " << eta << ", cosine " << cosine);
  CHECK(sum < (distribution == MICROFACET_GGX ? 1 + 1e-4 : 1.0035));
  CHECK(sum > 0.3);
  if (alpha == 0.1 && cosine == 1) CHECK(sum > 0.98);
}

TEST_CASE("rough dielectric samples follow their density (chi-square)", "[model][stat]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double alpha = GENERATE(0.05, 0.1, 0.3, 1.0), eta = GENERATE(1 / 1.5, 1.33);
  const double cosine = GENERATE(0.02, -0.3, 0.9);
  constexpr std::size_t n = 1 << 16;
  const Direction exact = direction(cosine, 0.4);
  const Direction wi{static_cast<float>(exact.x), static_cast<float>(exact.y), static_cast<float>(exact.z)};
  Columns in(9, std::vector<float>(n));
  std::size_t k = 0;
  for (const double value : {static_cast<double>(distribution), alpha, eta, wi.x, wi.y, wi.z})
    in[k++].assign(n, static_cast<float>(value));
  for (; k < 9; ++k) in[k] = uniform_numbers(n, static_cast<unsigned>(k));
  const Columns out = run_lanes(model, 16, in);
  std::vector<Point> angles;
  for (std::size_t i = 0; i < n; ++i) {
    if (out[3][i] > 0)
      angles.push_back({std::acos(std::clamp(out[2][i], -1.f, 1.f)), std::atan2(out[1][i], out[0][i])});
    else
      angles.push_back({NAN, NAN});  // lost to the wrong side
  }
  const Direction up{wi.x, wi.y, std::abs(wi.z)};
  const double fit =
      distribution == MICROFACET_GGX ? 1 : beckmann_shadowing(up, alpha) / beckmann_shadowing_exact(up, alpha);
  const auto density = [&](double theta, double phi) {
    const Direction wo{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
    return rough_dielectric_pdf(distribution, alpha, eta, wi, wo) * std::sin(theta) / fit;
  };
  const ChiSquare result = chi_square(angles, density, {0, PI_, -PI_, PI_, 48, 48});
  INFO("distribution " << distribution << ", alpha " << alpha << ", eta " << eta << ", cosine " << cosine
                       << ", chi-square " << result.statistic << ", degrees of freedom " << result.degrees_of_freedom);
  CHECK(result.degrees_of_freedom >= 10);
  CHECK(result.p_value > significance);
}

TEST_CASE("rough dielectric on the device matches double precision", "[model]") {
  const int width = GENERATE(1, 16);
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  constexpr std::size_t n = 30000;
  const auto cosine = uniform_numbers(n, 11, -1, 1), azimuth = uniform_numbers(n, 12, 0, 6.28);
  Columns in(9, std::vector<float>(n, static_cast<float>(distribution)));
  in[1] = uniform_numbers(n, 13, 0.05, 1);
  in[2] = uniform_numbers(n, 14, 1.2, 1.8);
  for (std::size_t i = 0; i < n; ++i) {
    const Direction wi = direction(cosine[i], azimuth[i]);
    in[3][i] = static_cast<float>(wi.x);
    in[4][i] = static_cast<float>(wi.y);
    in[5][i] = static_cast<float>(wi.z);
    if (i % 2) in[2][i] = 1 / in[2][i];
  }
  for (std::size_t k = 6; k < 9; ++k) in[k] = uniform_numbers(n, static_cast<unsigned>(20 + k));
  const Columns out = run_lanes(model, width, in);
  // The device's own wo goes into the double precision formulas: errors of value and density alone. Where |eta - 1| is
  // small h is a difference, and far out in the tails D magnifies h's error: the bound is for all but one in a
  // thousand.
  std::size_t wrong_value = 0, wrong_pdf = 0, wrong_weight = 0, wrong_direction = 0, wrong_ratio = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Direction wi{in[3][i], in[4][i], in[5][i]}, wo{out[0][i], out[1][i], out[2][i]};
    const double alpha = in[1][i], eta = in[2][i];
    const Sample s = sample(distribution, alpha, eta, wi, in[6][i], in[7][i], in[8][i]);
    wrong_direction += std::abs(wo.x - s.wo.x) + std::abs(wo.y - s.wo.y) + std::abs(wo.z - s.wo.z) > 1e-4;
    wrong_weight += !(std::abs(out[3][i] - s.weight) <= 1e-4 * s.weight);
    if (out[3][i] == 0) continue;
    wrong_ratio += !(std::abs(out[3][i] * out[7][i] - out[6][i]) <= 1e-3 * out[6][i] + 1e-6);
    const double value = rough_dielectric_eval(distribution, alpha, eta, wi, wo);
    const double pdf = rough_dielectric_pdf(distribution, alpha, eta, wi, wo);
    wrong_value += !(std::abs(out[6][i] - value) <= 3e-4 * value + 1e-6);
    wrong_pdf += !(std::abs(out[7][i] - pdf) <= 3e-4 * pdf + 1e-6);
  }
  CHECK(wrong_value < n / 1000);
  CHECK(wrong_pdf < n / 1000);
  CHECK(wrong_weight < n / 1000);
  CHECK(wrong_direction < n / 1000);
  CHECK(wrong_ratio < n / 1000);
}

TEST_CASE("rough dielectric: degenerate directions give 0 or a usable sample, never NaN", "[model]") {
  const int width = GENERATE(1, 4, 8, 16);
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  Columns in(9);
  for (const float alpha : {1e-4f, 0.1f, 1.f})
    for (const float eta : {1 / 1.5f, 1.5f, 1.f})
      for (const float z : {0.f, 1e-7f, -1e-7f, 1e-3f, 1.f, -1.f})
        for (const float u0 : {0x1p-24f, 0.5f, 1 - 0x1p-24f})
          for (const float u1 : {0x1p-24f, 0.25f, 1 - 0x1p-24f})
            for (const float u2 : {0x1p-24f, 0.5f, 1 - 0x1p-24f}) {
              const std::array<float, 9> row{
                  static_cast<float>(distribution), alpha, eta, std::sqrt(1 - z * z), 0, z, u0, u1, u2};
              for (std::size_t k = 0; k < 9; ++k) in[k].push_back(row[k]);
            }
  const Columns out = run_lanes(model, width, in);
  for (const auto& column : out)
    CHECK(std::all_of(column.begin(), column.end(), [](float x) { return std::isfinite(x) || x == INFINITY; }));
  double longest = 0, largest = 0;
  for (std::size_t i = 0; i < out[0].size(); ++i) {
    if (out[3][i] == 0) continue;
    const double length = std::hypot(out[0][i], out[1][i], out[2][i]);
    longest = std::max(longest, std::abs(length - 1));
    largest = std::max(largest, static_cast<double>(out[3][i]) * (out[5][i] > 0 ? 1 : in[2][i] * in[2][i]));
  }
  CHECK(longest < 1e-5);
  CHECK(largest <= 1 + 1e-6);
}
