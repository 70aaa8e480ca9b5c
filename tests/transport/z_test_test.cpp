// The tests' own statistics against tabulated values: a judge has to be judged first.
#include "../support/z_test.h"

#include <catch2/catch.hpp>
#include <random>

using namespace itn::test;

TEST_CASE("normal and chi-square tails match tables", "[support]") {
  CHECK(normal_cdf(1.959963985) == Approx(0.975).epsilon(1e-8));
  CHECK(normal_quantile(0.99865010196837) == Approx(3).epsilon(1e-8));
  CHECK(chi_square_tail(16.9190, 9) == Approx(0.05).epsilon(1e-4));
  CHECK(chi_square_tail(3.3251, 9) == Approx(0.95).epsilon(1e-4));
  CHECK(chi_square_tail(44.811, 9) == Approx(1.0e-6).epsilon(2e-2));
  CHECK(chi_square_tail(2, 2) == Approx(std::exp(-1.0)).epsilon(1e-12));
  CHECK(largest_z_bound(1, 0.0026997960632602) == Approx(3).epsilon(1e-6));
}

TEST_CASE("the z histogram accepts normal scores and rejects shifted, narrow and wide ones", "[support]") {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  std::vector<double> good, shifted, narrow, wide;
  for (int i = 0; i < 576; ++i) {
    const double z = normal(generator);
    good.push_back(z);
    shifted.push_back(z + 0.4);
    narrow.push_back(z * 0.7);
    wide.push_back(z * 1.4);
  }
  CHECK(z_histogram(good).p_value > 1e-3);
  CHECK(z_histogram(shifted).p_value < 1e-5);
  CHECK(z_histogram(narrow).p_value < 1e-5);
  CHECK(z_histogram(wide).p_value < 1e-5);
}
