#include "runtime/base/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

}  // namespace itn
