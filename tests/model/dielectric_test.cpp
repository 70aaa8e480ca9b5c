#include "kernels/model/bsdf/dielectric.h"

#include <catch2/catch.hpp>

#include "../support/lane_function.h"
#include "../support/z_test.h"
#include "compare.h"

using namespace itn::test;

namespace {

using Direction = Vector3<double>;

const LaneFunction model{{"model/bsdf/dielectric.h"},
                         {"eta", "wx", "wy", "wz", "u"},
                         {"x", "y", "z", "weight", "reflected"},
                         R"(
  REAL3 wo;
  MASK mirror;
  dielectric_sample(eta, make3(wx, wy, wz), u, &wo, &weight, &mirror);
  x = wo.x; y = wo.y; z = wo.z;
  reflected = SELECT(mirror, 1.0f, 0.0f);)"};

}  // namespace

TEST_CASE("smooth dielectric obeys the laws of reflection and refraction from both sides", "[model]") {
  const double eta = GENERATE(1 / 1.5, 1.0, 1.33), z = GENERATE(-0.9, -0.2, 0.1, 1.0);
  const Direction wi{std::sqrt(1 - z * z), 0, z};
  for (const double u : {1e-7, 1 - 1e-7}) {
    Direction wo{};
    double weight = 0;
    bool reflected = false;
    dielectric_sample(eta, wi, u, &wo, &weight, &reflected);
    CHECK(dot3(wo, wo) == Approx(1).epsilon(1e-12));
    if (reflected) {
      CHECK((wo.x == -wi.x && wo.z == wi.z && weight == 1));
    } else {
      CHECK(wo.x * eta == Approx(-wi.x).margin(1e-15));
      CHECK(wo.z * wi.z < 0);
      CHECK(weight == Approx(1 / (eta * eta)));
    }
  }
}

TEST_CASE("smooth dielectric on the device matches double precision and reflects the fraction F (z-test)",
          "[model][stat]") {
  const int width = GENERATE(1, 16);
  constexpr std::size_t n = 1 << 16;
  const Columns in{std::vector<float>(n, 1 / 1.4f), std::vector<float>(n, 0.6f), std::vector<float>(n, 0.f),
                   std::vector<float>(n, -0.8f), uniform_numbers(n, 1)};
  const Columns out = run_lanes(model, width, in);
  double reflected = 0;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < n; ++i) {
    Direction wo{};
    double weight = 0;
    bool mirror = false;
    dielectric_sample<double>(in[0][i], {in[1][i], in[2][i], in[3][i]}, in[4][i], &wo, &weight, &mirror);
    reflected += out[4][i];
    wrong += mirror != (out[4][i] == 1) ||
             std::abs(wo.x - out[0][i]) + std::abs(wo.y - out[1][i]) + std::abs(wo.z - out[2][i]) > 2e-6 ||
             std::abs(weight - out[3][i]) > 1e-6;
  }
  CHECK(wrong <= 1);  // u next to F
  const double f = fresnel_dielectric(0.8, 1 / 1.4);
  CHECK(std::abs(reflected - n * f) / std::sqrt(n * f * (1 - f)) < largest_z_bound(1, 1e-6));
}
