#include "z_test.h"

#include <algorithm>
#include <cmath>

namespace itn::test {

double chi_square_tail(double x, int degrees_of_freedom) {
  if (x <= 0) return 1;
  const double a = 0.5 * degrees_of_freedom, y = 0.5 * x;
  const double front = std::exp(-y + a * std::log(y) - std::lgamma(a));
  if (y < a + 1) {
    // Series of the lower incomplete gamma function.
    double term = 1 / a, sum = term;
    for (int n = 1; n < 1000 && term > sum * 1e-15; ++n) {
      term *= y / (a + n);
      sum += term;
    }
    return std::max(0.0, 1 - front * sum);
  }
  // Continued fraction of the upper one, evaluated from its far end.
  double fraction = 0;
  for (int n = 300; n >= 1; --n) fraction = n * (n - a) / (y + 2 * n + 1 - a - fraction);
  return front / (y + 1 - a - fraction);
}

ZHistogram z_histogram(const std::vector<double>& z, int bins) {
  ZHistogram result;
  result.bins = bins;
  const double expected = static_cast<double>(z.size()) / bins;
  if (expected < 5) return result;
  std::vector<double> count(static_cast<std::size_t>(bins), 0.0);
  for (const double value : z)
    count[static_cast<std::size_t>(std::clamp(static_cast<int>(normal_cdf(value) * bins), 0, bins - 1))] += 1;
  for (const double c : count) result.chi_square += (c - expected) * (c - expected) / expected;
  result.p_value = chi_square_tail(result.chi_square, bins - 1);
  return result;
}

}  // namespace itn::test
