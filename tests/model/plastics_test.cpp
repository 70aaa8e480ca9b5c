// Transmittance of a rough coating, as the host integrates it and the device evaluates it.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/model/coating.h"
#include "kernels/model/rough_transmittance.h"

namespace {

double passed(int distribution, double alpha, double eta, double mu) {
  std::array<double, ROUGH_TRANSMITTANCE_KNOTS> c{};
  rough_transmittance_coefficients(distribution, alpha, eta, c.data());
  return rough_transmittance(alpha, c.data(), mu);
}

}  // namespace

TEST_CASE("what a rough coating lets pass: the polynomial is near the integral", "[model]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double eta = GENERATE(1.1, 1.49, 2.2);
  for (const double alpha : {0.01, 0.1, 0.3, 1.0}) {
    std::array<double, ROUGH_TRANSMITTANCE_KNOTS> c{};
    rough_transmittance_coefficients(distribution, alpha, eta, c.data());
    double worst = 0;
    for (double mu = 1.0 / 64; mu <= 1; mu += 1.0 / 64)
      worst = std::max(worst, std::abs(rough_transmittance(alpha, c.data(), mu) -
                                       rough_transmittance_integral(distribution, alpha, eta, mu)));
    CAPTURE(distribution, eta, alpha, worst);
    CHECK(worst < (alpha == 1 ? 2e-3 : 1e-3));
  }
}

TEST_CASE("what a nearly smooth coating lets pass is 1 - F; what it keeps inside is the diffuse reflectance",
          "[model]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  for (const double eta : {1.3, 1.49, 1.9}) {
    for (const double mu : {0.05, 0.2, 0.5, 0.9, 1.0})
      CHECK(passed(distribution, 1e-3, eta, mu) == Approx(1 - fresnel_dielectric(mu, eta)).margin(2e-3));
    // 64 angles: 1 to 2 % below the integral, as in Mitsuba
    const double kept = rough_trapped(distribution, 1e-3, eta), integral = fresnel_diffuse_reflectance(1 / eta);
    CHECK(kept < integral);
    CHECK(kept > 0.97 * integral);
  }
}

TEST_CASE("a rough coating's integrals do not depend on how finely they are summed", "[model]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double alpha = GENERATE(0.05, 0.3, 1.0), mu = GENERATE(0.02, 0.3, 0.9);
  const auto seen = [&](const auto& wi, const auto& m) {
    return 1 - fresnel_dielectric(std::min(dot3(wi, m), 1.0), 1.49);
  };
  const double coarse = mean_over_visible_normals<24, 12>(distribution, alpha, mu, seen);
  const double fine = mean_over_visible_normals<96, 64>(distribution, alpha, mu, seen);
  CHECK(coarse == Approx(fine).margin(3e-4));
}
