// Statistics that several parts need. Questions whether a deviation is more than chance are told their significance:
// how often they may say so by chance.
#pragma once
#include <cstddef>
#include <vector>

namespace itn {

// Standard normal distribution function and its inverse (p in (0, 1)).
double normal_cdf(double z);
double normal_quantile(double p);

// |z| that `count` independent standard normal scores exceed anywhere with probability `significance` (Sidak).
double largest_z_bound(std::size_t count, double significance);

// The middle value, or the mean of the two in the middle; without values NaN.
double median(std::vector<double> values);

}  // namespace itn
