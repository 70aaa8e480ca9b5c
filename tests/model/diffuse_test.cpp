#include "kernels/model/bsdf/diffuse.h"

#include <catch2/catch.hpp>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "compare.h"

using namespace itn::test;

namespace {

const LaneFunction model{{"model/bsdf/diffuse.h"}, {"u1", "u2"}, {"x", "y", "z", "pdf", "value"}, R"(
  REAL3 wo = diffuse_sample(u1, u2);
  x = wo.x; y = wo.y; z = wo.z;
  pdf = diffuse_pdf(wo);
  value = diffuse_eval(NUMBER(0.7), wo);)"};

}  // namespace

TEST_CASE("Lambert reflects its albedo in all, and nothing from behind", "[model]") {
  const auto value = [](double z, double) { return 2 * PI_ * diffuse_eval(0.7, Vector3<double>{0, 0, z}); };
  CHECK(integrate(value, {-1, 1, 0, 1, 2, 1}, 1e-9) == Approx(0.7).epsilon(1e-9));
  CHECK(diffuse_eval(0.7, Vector3<double>{0.6, 0, -0.8}) == 0);
}

TEST_CASE("Lambert samples follow their density (chi-square), are unit and weigh the albedo", "[model][stat]") {
  const int width = GENERATE(1, 16);
  constexpr std::size_t n = 1 << 17;
  const Columns out = run_lanes(model, width, {uniform_numbers(n, 1), uniform_numbers(n, 2)});
  std::vector<Point> samples;
  double worst_length = 0, worst_weight = 0;
  for (std::size_t i = 0; i < n; ++i) {
    samples.push_back({out[2][i], std::atan2(out[1][i], out[0][i])});
    worst_length = std::max(worst_length, std::abs(std::hypot(out[0][i], out[1][i], out[2][i]) - 1.0));
    worst_weight = std::max(worst_weight, std::abs(out[4][i] / out[3][i] - 0.7));
  }
  CHECK(worst_length < 5e-7);
  CHECK(worst_weight < 5e-7);
  const auto density = [](double z, double) { return diffuse_pdf(Vector3<double>{0, 0, z}); };
  CHECK(chi_square(samples, density, {0, 1 + 1e-6, -PI_, PI_, 32, 32}).p_value > 1e-6);
}
