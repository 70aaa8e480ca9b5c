#include "runtime/inversion/prior.h"

#include <cmath>

#include "runtime/base/statistics.h"

namespace itn {

void Prior::add_interval(const std::vector<Coordinate>& coordinates, std::size_t i, double low, double high) {
  mean.resize(coordinates.size(), 0);
  precision.resize(coordinates.size(), 0);
  const double from = coordinates[i].of(low), to = coordinates[i].of(high);
  mean[i] = (from + to) / 2;
  precision[i] = std::pow(2 * normal_quantile(0.975) / (to - from), 2);
}

}  // namespace itn
