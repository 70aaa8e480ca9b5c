// Is a set of z-scores what chance alone gives? Every test is told its significance: how often it may fail by chance.
#pragma once
#include <cstddef>
#include <vector>

#include "runtime/base/statistics.h"

namespace itn::test {

using itn::largest_z_bound;
using itn::normal_cdf;
using itn::normal_quantile;

// Probability that a chi-square variable with that many degrees of freedom exceeds x.
double chi_square_tail(double x, int degrees_of_freedom);

// Chi-square of the scores' histogram against the standard normal, over bins of equal probability.
struct ZHistogram {
  int bins = 0;
  double chi_square = 0;
  double p_value = 1;  // 1 when there are too few scores (fewer than five expected a bin)
};
ZHistogram z_histogram(const std::vector<double>& z, int bins = 10);

}  // namespace itn::test
