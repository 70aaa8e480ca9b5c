// Random numbers from a counter.
#include "runtime/base/random.h"

#include <catch2/catch.hpp>
#include <cmath>

using namespace itn;

TEST_CASE("Mixed bits are SplitMix64's") {
  // The first numbers of java.util.SplittableRandom(0).nextLong(), whose counter goes up by the same constant.
  CHECK(mixed_bits(0) == 0xe220a8397b1dcdafu);
  CHECK(mixed_bits(0x9e3779b97f4a7c15u) == 0x6e789e6aa1b965f4u);
}

TEST_CASE("Normal numbers have the moments of the normal distribution, and streams do not resemble each other") {
  constexpr int count = 200000;
  double moments[4] = {}, mixed = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    const double x = random_normal(1, 2, i), power[4] = {x, x * x, x * x * x, x * x * x * x};
    for (int k = 0; k < 4; ++k) moments[k] += power[k] / count;
    mixed += x * random_normal(1, 3, i) / count;
  }
  const double error = 1 / std::sqrt(double(count));  // of the mean; the others' variances are 2, 15, 96
  CHECK(std::abs(moments[0]) < 4 * error);
  CHECK(std::abs(moments[1] - 1) < 4 * std::sqrt(2) * error);
  CHECK(std::abs(moments[2]) < 4 * std::sqrt(15) * error);
  CHECK(std::abs(moments[3] - 3) < 4 * std::sqrt(96) * error);
  CHECK(std::abs(mixed) < 4 * error);
}
