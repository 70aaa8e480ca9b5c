// Finite differences and the comparison that itn gradcheck makes with them, on functions and numbers that are known.
#include "runtime/render/derivative/difference.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "../support/z_test.h"

using namespace itn;

namespace {

Parameter parameter(double value, double low, double high, const std::string& member = "sigma_t") {
  Parameter p;
  p.value = value;
  p.low = low;
  p.high = high;
  p.member = member;
  return p;
}

double differentiate(const DifferenceStencil& s, double x, const std::function<double(double)>& f) {
  double sum = 0;
  for (std::size_t k = 0; k < s.offset.size(); ++k) sum += s.weight[k] * f(x + s.offset[k]);
  return sum;
}

constexpr double infinity = std::numeric_limits<double>::infinity();

// Batches of 40 x 40 grey pixels whose difference scatters by 1 around the truth, and whose derivative is wrong by
// `error`, relative.
double z_with(double error, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const std::size_t pixels = 1600;
  DerivativeComparison comparison(pixels, 1);
  for (int batch = 0; batch < 4; ++batch) {
    std::vector<float> derivative;
    std::vector<double> difference;
    for (std::size_t i = 0; i < pixels; ++i) {
      const double common = 2 + normal(random);
      derivative.push_back(static_cast<float>(common * (1 + error)));
      difference.push_back(common + normal(random));
    }
    comparison.add(derivative, difference);
  }
  return comparison.result(0)[0].z;
}

}  // namespace

TEST_CASE("central differences are exact to fourth order, one-sided ones at an end of the range to third") {
  const auto quartic = [](double x) { return 3 - x + 2 * x * x - x * x * x + 0.5 * x * x * x * x; };
  for (const double x : {0.2, 0.5, 0.9, 3.0}) {
    const auto s = difference_stencil({}, parameter(x, 0, infinity));
    CHECK(differentiate(s, x, quartic) == Approx(-1 + 4 * x - 3 * x * x + 2 * x * x * x).epsilon(1e-9));
  }
  const auto cubic = [](double x) { return 3 - x + 2 * x * x + x * x * x; };
  for (const double x : {0.0, 1.0}) {
    const auto s = difference_stencil({}, parameter(x, 0, 1));
    CHECK(differentiate(s, x, cubic) == Approx(-1 + 4 * x + 3 * x * x).epsilon(1e-9));
  }
}

TEST_CASE("no step leaves the range, however near its ends the value is") {
  for (const auto& [low, high] : {std::pair{0.0, 1.0}, {-1.0, 1.0}, {1.0, 10.0}, {0.0, infinity}})
    for (const double share : {0.0, 1e-9, 1e-4, 0.01, 0.5, 0.99, 1 - 1e-4, 1 - 1e-9, 1.0}) {
      const double x = std::isinf(high) ? low + 20 * share : low + share * (high - low);
      const Parameter p = parameter(x, low, high);
      const auto s = difference_stencil({}, p);
      INFO(x << " in [" << low << ", " << high << "]");
      CHECK(s.step > 0);
      for (const double offset : s.offset) CHECK(p.contains(x + offset));
    }
}

TEST_CASE("an index of refraction does not step across the one on the other side") {
  Scene scene;
  scene.bsdfs.resize(1);
  scene.bsdfs[0] = make_bsdf("dielectric");
  scene.bsdfs[0].set("int_ior", 1.05);
  scene.bsdfs[0].set("ext_ior", 1);
  for (const std::string kind : {"int_ior", "ext_ior"}) {
    const double value = kind == "int_ior" ? 1.05 : 1;
    CHECK(difference_stencil(scene, parameter(value, 0, infinity, kind)).step < 0.05);
  }
}

TEST_CASE("a turbidity does not step over a whole number; on one the mean of both sides is found") {
  const auto of = [](double value) { return parameter(value, 1, 10, "turbidity"); };
  CHECK(difference_stencil({}, of(2.9)).step < 0.1);
  CHECK(difference_stencil({}, of(3.2)).step < 0.2);
  // two parabolas that meet at 3: slopes 1 and -2, curvatures 4 and 10
  const auto kinked = [](double x) {
    return x < 3 ? (x - 3) + 2 * (x - 3) * (x - 3) : -2 * (x - 3) + 5 * (x - 3) * (x - 3);
  };
  CHECK(differentiate(difference_stencil({}, of(3)), 3, kinked) == Approx(-0.5).epsilon(1e-9));
}

TEST_CASE("z-scores of right derivatives are standard normal") {
  std::vector<double> z;
  for (unsigned seed = 0; seed < 400; ++seed) z.push_back(z_with(0, seed));
  CHECK(itn::test::z_histogram(z).p_value > 1e-4);
}

TEST_CASE("a derivative that is wrong by 10 % is found, one that is right is not accused") {
  // standard error of the mean of the differences: 1 / sqrt(4 * 1600) = 0.0125; the error: 0.2
  CHECK(std::fabs(z_with(0, 1)) < 4);
  CHECK(z_with(0.1, 1) > 12);
  CHECK(z_with(-0.1, 1) < -12);
}

TEST_CASE("a derivative that is not a number does not pass") {
  DerivativeComparison comparison(2, 1);
  for (int batch = 0; batch < 2; ++batch) comparison.add({1, NAN}, {1, 1});
  CHECK_FALSE(std::fabs(comparison.result(0)[0].z) < 100);
}

TEST_CASE("where both vanish they agree, and rounding is no disagreement") {
  DerivativeComparison zero(4, 1), rounded(4, 1), wrong(4, 1);
  for (int batch = 0; batch < 2; ++batch) {
    zero.add({0, 0, 0, 0}, {0, 0, 0, 0});
    rounded.add({0, 0, 0, 0}, {1e-8, 1e-8, 1e-8, 1e-8});
    wrong.add({0, 0, 0, 0}, {1, 1, 1, 1});
  }
  CHECK(zero.result(0)[0].z == 0);
  CHECK(zero.result(0)[0].pixels == 0);
  CHECK(std::fabs(rounded.result(1e-7)[0].z) < 1);
  CHECK(std::isinf(wrong.result(0)[0].z));
}

TEST_CASE("pixels that disagree on their own are counted even where their sum agrees") {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  DerivativeComparison comparison(1000, 1);
  for (int batch = 0; batch < 4; ++batch) {
    std::vector<float> derivative;
    std::vector<double> difference;
    for (int i = 0; i < 1000; ++i) {
      derivative.push_back(1.0f + (i % 2 ? 0.5f : -0.5f));
      difference.push_back(1 + 0.01 * normal(random));
    }
    comparison.add(derivative, difference);
  }
  const auto result = comparison.result(0)[0];
  CHECK(std::fabs(result.z) < 4);
  CHECK(result.pixels == 1000);
  CHECK(result.beyond_95 > 0.99);
}

TEST_CASE("right pixels exceed their own 95 % limit one time in twenty") {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  const std::size_t pixels = 20000;
  DerivativeComparison comparison(pixels, 1);
  for (int batch = 0; batch < 4; ++batch) {
    std::vector<float> derivative(pixels, 1);
    std::vector<double> difference;
    for (std::size_t i = 0; i < pixels; ++i) difference.push_back(1 + normal(random));
    comparison.add(derivative, difference);
  }
  CHECK(comparison.result(0)[0].beyond_95 == Approx(0.05).margin(4 * std::sqrt(0.05 * 0.95 / pixels) + 0.001));
}
