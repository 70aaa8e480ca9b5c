// The principled BSDFs beyond what bsdfs_test.cpp asks of all: samples from below, at grazing angles and at the ends of
// the ranges; limits that are other BSDFs.
#include "kernels/model/bsdf/principled.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "../support/chi_square.h"
#include "kernels/model/bsdf/principled_thin.h"
#include "kernels/model/bsdf/principled_transmission.h"

using namespace itn::test;

namespace {

using Direction = Vector3<double>;

Direction direction(double cosine, double phi) {
  const double sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(phi), sine * std::sin(phi), cosine};
}

// Numbers with eta 1.45 and sampling rates of 1.
template <int count>
std::vector<double> numbers(int eta, const std::vector<std::pair<int, double>>& values) {
  std::vector<double> n(count, 0.0);
  for (int k = LOBES_base_color; k <= LOBES_base_color_last; ++k) n[static_cast<std::size_t>(k)] = 0.8;
  n[LOBES_roughness] = 0.5;
  n[static_cast<std::size_t>(eta)] = 1.45;
  for (auto k = static_cast<std::size_t>(eta) + 1; k < n.size(); ++k) n[k] = 1;
  for (const auto& [slot, value] : values) n[static_cast<std::size_t>(slot)] = value;
  return n;
}

template <class Draw, class Density>
void check_samples(const std::vector<double>& n, const Direction& wi, Draw draw, Density density) {
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Point> samples;
  int off = 0;
  for (int i = 0; i < 1 << 16; ++i) {
    const double u[3] = {uniform(generator), uniform(generator), uniform(generator)};
    Direction wo{};
    double weight[3], pdf = 0, scale = 0;
    draw(0, n.data(), wi, u, &wo, weight, &pdf, &scale);
    samples.push_back({pdf > 0 ? wo.z : std::nan(""), std::atan2(wo.y, wo.x)});
    off += pdf > 0 && std::abs(pdf - density(0, n.data(), wi, wo)) > 1e-6 * pdf;
  }
  const auto at = [&](double z, double phi) { return density(0, n.data(), wi, direction(z, phi)); };
  const ChiSquare result = chi_square(samples, at, {-1, 1 + 1e-6, -PI_, PI_, 48, 24});
  CAPTURE(wi.z, result.statistic, result.degrees_of_freedom);
  CHECK(result.p_value > 1e-6);
  CHECK(off == 0);
}

#define DRAW(name)                                                                                        \
  [](int v, const double* n_, Direction in, const double* u, Direction* out, double* weight, double* pdf, \
     double* scale) { name##_draw(v, n_, in, u, out, weight, pdf, scale); }
#define DENSITY(name) \
  [](int v, const double* n_, Direction in, Direction out) { return name##_density(v, n_, in, out); }

}  // namespace

TEST_CASE("samples of principled surfaces follow their densities at the ends of the ranges", "[model][stat]") {
  const double cosine = GENERATE(1.0, 0.05, 0.6);
  const Direction wi = direction(cosine, 2.1);
  for (const auto& values : std::vector<std::vector<std::pair<int, double>>>{
           {{LOBES_roughness, 1}, {LOBES_anisotropic, 1}},
           {{LOBES_roughness, 0.25}, {PRINCIPLED_metallic, 1}},
           {{LOBES_roughness, 0.4}, {PRINCIPLED_clearcoat, 1}, {PRINCIPLED_clearcoat_gloss, 0}},
           {{PRINCIPLED_main_specular_sampling_rate, 0}, {PRINCIPLED_clearcoat, 1}, {LOBES_sheen, 1}}})
    check_samples(numbers<PRINCIPLED_SLOTS>(PRINCIPLED_eta, values), wi, DRAW(principled), DENSITY(principled));
}

TEST_CASE("samples of principled boundaries follow their densities from both sides", "[model][stat]") {
  const double cosine = GENERATE(1.0, 0.05, 0.6, -0.05, -0.6, -1.0), eta = GENERATE(1.45, 0.7);
  const Direction wi = direction(cosine, 2.1);
  for (const auto& values : std::vector<std::vector<std::pair<int, double>>>{
           {{LOBES_roughness, 1}, {LOBES_anisotropic, 1}, {PRINCIPLED_TRANSMISSION_spec_trans, 1}},
           {{LOBES_roughness, 0.4}, {PRINCIPLED_TRANSMISSION_spec_trans, 0.3}},
           {{PRINCIPLED_TRANSMISSION_spec_trans, 0.6},
            {PRINCIPLED_TRANSMISSION_clearcoat, 1},
            {PRINCIPLED_TRANSMISSION_metallic, 0.4}}}) {
    std::vector<double> n = numbers<PRINCIPLED_TRANSMISSION_SLOTS>(PRINCIPLED_TRANSMISSION_eta, values);
    n[PRINCIPLED_TRANSMISSION_eta] = eta;
    check_samples(n, wi, DRAW(principled_transmission), DENSITY(principled_transmission));
  }
}

TEST_CASE("samples of thin principled sheets follow their densities from both sides", "[model][stat]") {
  const double cosine = GENERATE(1.0, 0.05, 0.6, -0.05, -0.6);
  const Direction wi = direction(cosine, 2.1);
  for (const auto& values : std::vector<std::vector<std::pair<int, double>>>{
           {{LOBES_roughness, 1}, {LOBES_anisotropic, 1}, {PRINCIPLED_THIN_spec_trans, 1}},
           {{PRINCIPLED_THIN_spec_trans, 0.4}, {PRINCIPLED_THIN_diff_trans, 2}},
           {{PRINCIPLED_THIN_diff_trans, 0.7}, {LOBES_sheen, 1}}})
    check_samples(numbers<PRINCIPLED_THIN_SLOTS>(PRINCIPLED_THIN_eta, values), wi, DRAW(principled_thin),
                  DENSITY(principled_thin));
}

TEST_CASE("a principled boundary that only transmits is a rough dielectric; one that does not is opaque", "[model]") {
  std::vector<double> clear =
      numbers<PRINCIPLED_TRANSMISSION_SLOTS>(PRINCIPLED_TRANSMISSION_eta, {{PRINCIPLED_TRANSMISSION_spec_trans, 1}});
  for (int c = 0; c < 3; ++c) clear[static_cast<std::size_t>(LOBES_base_color + c)] = 1;
  const std::vector<double> glass{0.25, 1.45, 1, 1, 1, 1, 1, 1};  // alpha is the square of roughness
  const auto opaque = numbers<PRINCIPLED_SLOTS>(PRINCIPLED_eta, {{LOBES_sheen, 0.4}, {PRINCIPLED_metallic, 0.3}});
  const auto closed = numbers<PRINCIPLED_TRANSMISSION_SLOTS>(
      PRINCIPLED_TRANSMISSION_eta, {{LOBES_sheen, 0.4}, {PRINCIPLED_TRANSMISSION_metallic, 0.3}});
  std::mt19937_64 generator(6);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 500; ++i) {
    const Direction wi = direction(uniform(generator), 3 * uniform(generator)),
                    wo = direction(uniform(generator), 3 * uniform(generator));
    double f[3], expected[3];
    principled_transmission_value(0, clear.data(), wi, wo, f);
    rough_dielectric_value(MICROFACET_GGX, glass.data(), wi, wo, expected);
    // from above, F with b = 1 is that of the dielectric
    CHECK(f[0] == Approx(expected[0]).epsilon(1e-9).margin(1e-12));
    if (wi.z < 0) continue;
    principled_transmission_value(0, closed.data(), wi, wo, f);
    principled_value(0, opaque.data(), wi, wo, expected);
    CHECK(f[1] == Approx(expected[1]).epsilon(1e-9).margin(1e-12));
    CHECK(principled_transmission_density(0, closed.data(), wi, wo) ==
          Approx(principled_density(0, opaque.data(), wi, wo)).epsilon(1e-9).margin(1e-12));
  }
}
