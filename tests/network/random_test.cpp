// Orders from a counter's random numbers.
#include "network/model/random.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

using namespace itn;

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
