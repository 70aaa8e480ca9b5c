// An inversion's uncertainty, for people: intervals, derived quantities, and the directions that the image cannot tell
// apart.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "itn/scene.h"
#include "runtime/inverse/coordinate.h"

namespace itn {

struct Interval {
  std::string name;
  double value = 0, low = 0, high = 0;  // low to high: 95 %
  double stderr_ = 0;
  bool holds = true;  // false: what it rests on is not so; the verdict says what
};

// 95 % intervals of the parameters: even in the coordinates, so always within the parameters' ranges. x, covariance: of
// the coordinates, further unknowns after them are not looked at.
std::vector<Interval> intervals(const std::vector<Coordinate>& coordinates, const std::vector<double>& x,
                                const Eigen::MatrixXd& covariance);

// Intervals of the exposures, whose logarithms are the unknowns after the parameters. names: of all unknowns.
std::vector<Interval> exposures(const std::vector<Coordinate>& coordinates, const std::vector<double>& x,
                                const Eigen::MatrixXd& covariance, const std::vector<std::string>& names);

// Reduced scattering sigma_t albedo (1 - g) and absorption sigma_t (1 - albedo) [1/scene unit] of the media that the
// parameters belong to: what diffuse light depends on, and so what an image tells first. scene: with the values found.
std::vector<Interval> transport_coefficients(const Scene& scene, const std::vector<Coordinate>& coordinates,
                                             const std::vector<double>& x, const Eigen::MatrixXd& covariance);

// An eigenvector of the parameters' covariance, in d log p (numbers that may be negative, such as g: d p).
struct Direction {
  std::vector<double> part;  // one a parameter; unit length, the largest is positive
  double uncertainty = 0;    // standard error along it
};

// From the best known to the worst.
std::vector<Direction> ambiguity(const std::vector<Coordinate>& coordinates, const std::vector<double>& x,
                                 const Eigen::MatrixXd& covariance);

// One standard error along it, "skin.sigma_t +31 %, skin.g +0.24": the parts that matter, from the largest.
std::string words(const Direction& direction, const std::vector<Coordinate>& coordinates);

}  // namespace itn
