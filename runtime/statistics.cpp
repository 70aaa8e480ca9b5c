#include "runtime/statistics.h"

#include <algorithm>
#include <cmath>

namespace itn {

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

double normal_quantile(double p) {
  double low = -40, high = 40;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (normal_cdf(middle) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double largest_z_bound(std::size_t count, double significance) {
  // 1 - (1 - 2 tail)^count = significance, solved for the tail without cancellation.
  const double tail =
      -0.5 * std::expm1(std::log1p(-significance) / static_cast<double>(std::max<std::size_t>(count, 1)));
  return -normal_quantile(tail);
}

}  // namespace itn
