// Random numbers from a counter.
#include "network/random.h"

#include <algorithm>
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

TEST_CASE("A random order holds every number once, every one as often at every place, and depends on seed and stream") {
  const std::vector<std::size_t> order = random_order(1, RANDOM_ORDER, 1000);
  std::vector<std::size_t> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 0; i < 1000; ++i) CHECK(sorted[i] == i);
  CHECK(order == random_order(1, RANDOM_ORDER, 1000));
  CHECK(order != random_order(2, RANDOM_ORDER, 1000));
  CHECK(order != random_order(1, RANDOM_ORDER + 1, 1000));
  CHECK(random_order(1, RANDOM_ORDER, 0).empty());

  constexpr int trials = 6000;
  int counts[3][3] = {};
  for (std::uint64_t trial = 0; trial < trials; ++trial) {
    const std::vector<std::size_t> three = random_order(5, RANDOM_ORDER + trial, 3);
    for (std::size_t place = 0; place < 3; ++place) ++counts[place][three[place]];
  }
  for (const auto& place : counts)
    for (const int count : place) CHECK(std::abs(count - trials / 3) < 4 * std::sqrt(trials * 2.0 / 9));
}
