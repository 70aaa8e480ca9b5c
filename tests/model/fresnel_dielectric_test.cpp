#include "kernels/model/fresnel_dielectric.h"

#include <catch2/catch.hpp>

#include "../support/lane_function.h"
#include "compare.h"

using namespace itn::test;

namespace {

double reflectance(double cos_i, double eta) {
  const double cos_t2 = 1 - (1 - cos_i * cos_i) / (eta * eta);
  if (cos_t2 <= 0) return 1;
  const double cos_t = std::sqrt(cos_t2);
  const double s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t), p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  return 0.5 * (s * s + p * p);
}

}  // namespace

TEST_CASE("Fresnel: normal incidence, Brewster's angle, total reflection, grazing, equal indices", "[model]") {
  const double eta = GENERATE(1.0 / 1.5, 1.1, 1.33, 1.5, 2.4);
  CHECK(fresnel_dielectric(1.0, eta) == Approx((eta - 1) * (eta - 1) / ((eta + 1) * (eta + 1))).epsilon(1e-12));
  // At Brewster's angle only the perpendicular polarisation is reflected: F = ((1 - eta^2) / (1 + eta^2))^2 / 2.
  const double brewster = std::cos(std::atan(eta)), s = (1 - eta * eta) / (1 + eta * eta);
  CHECK(fresnel_dielectric(brewster, eta) == Approx(0.5 * s * s).epsilon(1e-12));
  CHECK(fresnel_dielectric(0.0, eta) == Approx(1));
  CHECK(fresnel_dielectric(0.3, 1.0) == 0);
  const double critical = std::sqrt(1 - 1 / (eta * eta));
  if (eta > 1) {
    CHECK(fresnel_dielectric(critical * 0.999, 1 / eta) == 1);
    CHECK(fresnel_dielectric(critical * 1.001, 1 / eta) < 1);
  }
}

TEST_CASE("Fresnel reflectance is the same from both sides", "[model]") {
  for (const double cos_i : {0.01, 0.2, 0.6, 0.95}) {
    double f = 0, cos_t = 0, back = 0, cos_back = 0;
    fresnel_dielectric_refract(cos_i, 1.4, &f, &cos_t);
    fresnel_dielectric_refract(cos_t, 1 / 1.4, &back, &cos_back);
    CHECK(back == Approx(f).epsilon(1e-12));
    CHECK(cos_back == Approx(cos_i).epsilon(1e-12));
  }
}

TEST_CASE("Fresnel on the device matches the textbook formula in double precision", "[model]") {
  const int width = GENERATE(1, 16);
  constexpr std::size_t n = 100000;
  const auto cos_i = uniform_numbers(n, 1), eta = uniform_numbers(n, 2, 0.4, 2.5);
  const LaneFunction fresnel{
      {"model/fresnel_dielectric.h"},
      {"cos_i", "eta"},
      {"f", "cos_t", "f2"},
      "fresnel_dielectric_refract(cos_i, eta, &f, &cos_t); f2 = fresnel_dielectric(cos_i, eta);"};
  const Columns out = run_lanes(fresnel, width, {cos_i, eta});
  CHECK(out[0] == out[2]);
  // Next to the critical angle F and cos_t change like a square root: the distance to it loses its digits there.
  std::vector<float> f, cos_t;
  std::vector<std::size_t> row;
  for (std::size_t i = 0; i < n; ++i) {
    const double square = fresnel_refracted_square<double>(cos_i[i], eta[i]);
    if (square < 0 && !(std::abs(out[0][i] - 1) < 2e-3)) FAIL_CHECK("no total reflection at " << cos_i[i]);
    if (std::abs(square) < 1e-4) continue;
    row.push_back(i);
    f.push_back(out[0][i]);
    cos_t.push_back(out[1][i]);
  }
  CHECK(largest_error(f, 1e-3, [&](auto i) { return reflectance(cos_i[row[i]], eta[row[i]]); }) < 3e-4);
  CHECK(largest_error(cos_t, 0, [&](auto i) {
          const double c = cos_i[row[i]], e = eta[row[i]];
          return std::sqrt(std::max(1 - (1 - c * c) / (e * e), 0.0));
        }) < 1e-3);
}
