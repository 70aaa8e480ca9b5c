// Prior knowledge of the parameters: a normal distribution of their coordinates.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "runtime/inverse/coordinate.h"

namespace itn {

struct Prior {
  // One a coordinate, or none at all. precision: the inverse of the covariance, 0 along what nothing is known of.
  std::vector<double> mean;
  Eigen::MatrixXd precision;

  // Coordinate `i` of `coordinates` lies between those of the values low < high with a probability of 95 %. Throws
  // UsageError: a value outside of the parameter's range.
  void add_interval(const std::vector<Coordinate>& coordinates, std::size_t i, double low, double high);

  // Coordinates `which` of `coordinates` have mean and covariance of samples: of each the values of these parameters.
  // More samples than coordinates. Throws as add_interval().
  void add_samples(const std::vector<Coordinate>& coordinates, const std::vector<std::size_t>& which,
                   const std::vector<std::vector<double>>& samples);

 private:
  void make_room(std::size_t coordinates);
};

}  // namespace itn
