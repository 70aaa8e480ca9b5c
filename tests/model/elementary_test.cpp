#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "../support/lane_function.h"
#include "compare.h"

using namespace itn::test;

namespace {

// |value - exact| in units in the last place of exact.
double ulp(float value, double exact) {
  int exponent = 0;
  std::frexp(exact, &exponent);
  return std::abs(value - exact) / std::ldexp(1.0, exponent - 24);
}

const LaneFunction logarithm{{}, {"x"}, {"y"}, "y = real_log(x);"};
const LaneFunction exponential{{}, {"x"}, {"y"}, "y = real_exp(x);"};
const LaneFunction turn{{}, {"x"}, {"s", "c"}, "sin_cos_2pi(x, &s, &c);"};

}  // namespace

TEST_CASE("log is within 3 ulp from 1e-37 to 1e38 and around 1", "[elementary]") {
  const int width = GENERATE(1, 16);
  std::vector<float> x = uniform_numbers(100000, 1);
  for (const float e : uniform_numbers(50000, 2, -37, 38)) x.push_back(std::pow(10.f, e));
  for (const float d : uniform_numbers(50000, 3, -1e-3, 1e-3)) x.push_back(1 + d);
  const Columns y = run_lanes(logarithm, width, {x});
  double worst = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (x[i] != 1.f) worst = std::max(worst, ulp(y[0][i], std::log(static_cast<double>(x[i]))));
  CHECK(worst < 3);
}

TEST_CASE("log of 1 is 0, of 0 and denormals about -88, of infinity finite", "[elementary]") {
  const int width = GENERATE(1, 16);
  const Columns y = run_lanes(logarithm, width, {{1.f, 0.f, 1e-40f, std::numeric_limits<float>::infinity()}});
  CHECK(y[0][0] == 0.f);
  CHECK((y[0][1] > -88.1f && y[0][1] < -87.3f));
  CHECK((y[0][2] > -88.1f && y[0][2] < -87.3f));
  CHECK(y[0][3] == Approx(88.72).epsilon(1e-3));
}

TEST_CASE("exp is within 2 ulp where the result is a normal float", "[elementary]") {
  const int width = GENERATE(1, 16);
  std::vector<float> x = uniform_numbers(100000, 4, -87.3, 88.3);
  for (const float small : uniform_numbers(20000, 5, -1, 1)) x.push_back(small);
  const Columns y = run_lanes(exponential, width, {x});
  double worst = 0;
  for (std::size_t i = 0; i < x.size(); ++i) worst = std::max(worst, ulp(y[0][i], std::exp(static_cast<double>(x[i]))));
  CHECK(worst < 2);
}

TEST_CASE("exp of 0 is 1, of very negative numbers 0, of large ones finite", "[elementary]") {
  const int width = GENERATE(1, 16);
  const float inf = std::numeric_limits<float>::infinity();
  const Columns y = run_lanes(exponential, width, {{0.f, -87.4f, -1e6f, -inf, 1e6f, inf}});
  CHECK(y[0][0] == 1.f);
  CHECK(y[0][1] == 0.f);
  CHECK(y[0][2] == 0.f);
  CHECK(y[0][3] == 0.f);
  CHECK(y[0][4] == Approx(2.2e38).epsilon(0.02));
  CHECK(y[0][5] == y[0][4]);
}

TEST_CASE("sine and cosine of 2 pi x are within 1e-7 on [0, 1]", "[elementary]") {
  const int width = GENERATE(1, 16);
  std::vector<float> x = uniform_numbers(100000, 6);
  for (int i = 0; i <= 8; ++i) x.push_back(static_cast<float>(i) / 8);
  const Columns y = run_lanes(turn, width, {x});
  double worst = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double angle = 2 * M_PI * x[i];
    worst = std::max({worst, std::abs(y[0][i] - std::sin(angle)), std::abs(y[1][i] - std::cos(angle))});
  }
  CHECK(worst < 1e-7);
}
