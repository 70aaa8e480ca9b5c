// What is known of the parameters before an image is seen: independent normal distributions of their coordinates.
#pragma once
#include <vector>

namespace itn {

struct Prior {
  // One a coordinate, or none at all; precision 1 / variance, 0 where nothing is known.
  std::vector<double> mean, precision;
};

}  // namespace itn
