// Is a set of z-scores what chance alone gives? Every test is told its significance: how often it may fail by chance.
#pragma once
#include <cstddef>
#include <vector>

namespace itn::test {

// Standard normal distribution function and its inverse (p in (0, 1)).
double normal_cdf(double z);
double normal_quantile(double p);

// Probability that a chi-square variable with that many degrees of freedom exceeds x.
double chi_square_tail(double x, int degrees_of_freedom);

// |z| that `count` independent standard normal scores exceed anywhere with probability `significance` (Sidak).
double largest_z_bound(std::size_t count, double significance);

// Chi-square of the scores' histogram against the standard normal, over bins of equal probability.
struct ZHistogram {
  int bins = 0;
  double chi_square = 0;
  double p_value = 1;  // 1 when there are too few scores (fewer than five expected a bin)
};
ZHistogram z_histogram(const std::vector<double>& z, int bins = 10);

}  // namespace itn::test
