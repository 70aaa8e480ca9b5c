// Common code of the stage tests.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "itn/device.h"

namespace itn::test {

inline const Device& device() {
  static const Device shared;
  return shared;
}

// One lane, as GPUs run it, and as many as the device has. The environment variable ITN_TEST_WIDTH leaves one of them
// (tools/lab/oclgrind).
inline const std::vector<int>& widths() {
  static const std::vector<int> tested = [] {
    if (const char* width = std::getenv("ITN_TEST_WIDTH")) return std::vector<int>{std::atoi(width)};
    return std::vector<int>{1, std::max(4, device().default_width())};
  }();
  return tested;
}

// Largest distance between the distribution of the values and a cumulative distribution function.
template <class Cdf>
double largest_gap(std::vector<double> values, const Cdf& cdf) {
  std::sort(values.begin(), values.end());
  double gap = 0;
  const double n = static_cast<double>(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double p = cdf(values[i]), k = static_cast<double>(i);
    gap = std::max({gap, std::abs(p - k / n), std::abs(p - (k + 1) / n)});
  }
  return gap;
}

// The gap that chance exceeds once in a million times (Kolmogorov, Smirnov).
inline double kolmogorov_bound(std::size_t n) { return std::sqrt(-0.5 * std::log(0.5e-6) / static_cast<double>(n)); }

}  // namespace itn::test
