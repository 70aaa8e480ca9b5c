#include <catch2/catch.hpp>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "compare.h"
#include "kernels/model/medium/homogeneous.h"

using namespace itn::test;

namespace {

const LaneFunction model{{"model/medium/homogeneous.h"},
                         {"sigma_t", "distance", "u"},
                         {"transmittance", "density", "sampled"},
                         R"(
  transmittance = medium_transmittance(sigma_t, distance);
  density = medium_free_flight(sigma_t, distance);
  sampled = medium_free_flight_sample(sigma_t, u);)"};

}  // namespace

TEST_CASE("transmittance is the chance of a longer free flight", "[model]") {
  const double sigma_t = 3.2, distance = 0.4;
  const auto density = [&](double d, double) { return medium_free_flight(sigma_t, d); };
  CHECK(integrate(density, {distance, 20, 0, 1, 64, 1}, 1e-10) == Approx(medium_transmittance(sigma_t, distance)));
  CHECK(medium_transmittance(0.0, 5.0) == 1);
}

TEST_CASE("homogeneous medium on the device matches double precision", "[model]") {
  const int width = GENERATE(1, 16);
  constexpr std::size_t n = 50000;
  const auto sigma_t = uniform_numbers(n, 1, 0.1, 300), distance = uniform_numbers(n, 2, 0, 0.05),
             u = uniform_numbers(n, 3);
  const Columns out = run_lanes(model, width, {sigma_t, distance, u});
  // the rounding of an optical depth up to 15 shows in its exponential
  CHECK(largest_error(out[0], 0, [&](auto i) { return medium_transmittance<double>(sigma_t[i], distance[i]); }) < 2e-6);
  CHECK(largest_error(out[1], 0, [&](auto i) { return medium_free_flight<double>(sigma_t[i], distance[i]); }) < 2e-6);
  CHECK(largest_error(out[2], 0, [&](auto i) { return medium_free_flight_sample<double>(sigma_t[i], u[i]); }) < 1e-6);
}

TEST_CASE("free flights follow their density (chi-square); none are 0; without a medium they never end",
          "[model][stat]") {
  const int width = GENERATE(1, 16);
  constexpr std::size_t n = 1 << 17;
  const float sigma_t = 25;
  Columns out =
      run_lanes(model, width, {std::vector<float>(n, sigma_t), std::vector<float>(n, 0.f), uniform_numbers(n, 4)});
  CHECK(*std::min_element(out[2].begin(), out[2].end()) > 0);
  std::vector<Point> flights;
  for (const float d : out[2]) flights.push_back({d, 0.5});
  const auto density = [&](double d, double) { return medium_free_flight<double>(sigma_t, d); };
  CHECK(chi_square(flights, density, {0, 0.4, 0, 1, 400, 1}).p_value > 1e-6);
  out = run_lanes(model, width, {{0.f}, {1e30f}, {0.5f}});
  CHECK(out[0][0] == 1);
  CHECK(out[2][0] == INFINITY);
}
