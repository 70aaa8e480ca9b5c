// Is a deviation more than chance? Every question is told its significance: how often it may say so by chance.
#pragma once
#include <cstddef>

namespace itn {

// Standard normal distribution function and its inverse (p in (0, 1)).
double normal_cdf(double z);
double normal_quantile(double p);

// |z| that `count` independent standard normal scores exceed anywhere with probability `significance` (Sidak).
double largest_z_bound(std::size_t count, double significance);

}  // namespace itn
