// What is known of the parameters before an image is seen: independent normal distributions of their coordinates.
#pragma once
#include <vector>

#include "runtime/inversion/coordinate.h"

namespace itn {

struct Prior {
  // One a coordinate, or none at all; precision 1 / variance, 0 where nothing is known.
  std::vector<double> mean, precision;

  // Coordinate `i` of `coordinates` lies between those of the values low < high with a probability of 95 %. Throws
  // UsageError: a value outside of the parameter's range.
  void add_interval(const std::vector<Coordinate>& coordinates, std::size_t i, double low, double high);
};

}  // namespace itn
