// Points that fill a cube evenly, however many are taken: the additive recurrence of the generalised golden ratio
// (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences").
#pragma once
#include <Eigen/Core>
#include <cmath>

namespace itn {

// Point `index` of the sequence in [-1, 1]^dimensions.
inline Eigen::VectorXd low_discrepancy_point(Eigen::Index dimensions, int index) {
  double ratio = 2;  // the positive root of r^(d + 1) = r + 1
  for (int k = 0; k < 60; ++k) ratio = std::pow(1 + ratio, 1 / (static_cast<double>(dimensions) + 1));
  Eigen::VectorXd point(dimensions);
  for (Eigen::Index i = 0; i < dimensions; ++i) {
    const double u = 0.5 + (index + 1) * std::pow(ratio, -static_cast<double>(i + 1));
    point[i] = 2 * (u - std::floor(u)) - 1;
  }
  return point;
}

}  // namespace itn
