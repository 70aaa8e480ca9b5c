// Device results against the same formula in double precision.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace itn::test {

// |value - reference| / (|reference| + floor), largest over all rows; infinite if any value is not finite.
template <class Reference>
double largest_error(const std::vector<float>& value, double floor, Reference&& reference) {
  double worst = 0;
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (!std::isfinite(value[i])) return INFINITY;
    const double r = reference(i);
    worst = std::max(worst, std::abs(static_cast<double>(value[i]) - r) / (std::abs(r) + floor));
  }
  return worst;
}

}  // namespace itn::test
