// Random layers, and gradients by finite differences.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "reference.h"
#include "runtime/base/random.h"

// Normal numbers, a function of seed and stream.
inline reference::Numbers random_numbers(std::size_t count, std::uint64_t stream, double deviation = 1) {
  reference::Numbers numbers(count);
  for (std::size_t i = 0; i < count; ++i) numbers[i] = deviation * itn::random_normal(20261121, stream, i);
  return numbers;
}

// The same numbers as float, and rounded to float: what float layers and their references in double both get.
inline std::vector<float> as_floats(const reference::Numbers& numbers) { return {numbers.begin(), numbers.end()}; }
inline reference::Numbers rounded(const reference::Numbers& numbers) {
  const std::vector<float> floats = as_floats(numbers);
  return {floats.begin(), floats.end()};
}

inline double dot(const reference::Numbers& a, const reference::Numbers& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// d f() / d x[i] by a central difference. f reads x.
template <class Function>
double difference(reference::Numbers& x, std::size_t i, Function f, double step = 1e-6) {
  const double at = x[i];
  x[i] = at + step;
  const double above = f();
  x[i] = at - step;
  const double below = f();
  x[i] = at;
  return (above - below) / (2 * step);
}
