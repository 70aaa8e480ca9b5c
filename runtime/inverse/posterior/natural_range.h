// The range and prior of a parameter before an image is seen, and the coordinate in which images change evenly with it.
//
// The coordinate is log v for numbers that are above 0 and have no upper bound or a lower one above 0. For numbers with
// two bounds it is the arcsine of the square root of the share of the range: near an albedo of 1 an image changes with
// the square root of 1 - albedo, and so does this coordinate. Unlike a logit it ends at the bounds. It is scaled to
// [-1, 1] over the interval that is asked for.
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "runtime/inverse/coordinate.h"
#include "runtime/inverse/prior.h"

namespace itn {

class NaturalRange {
 public:
  // Evenly between low and high: in log v where the coordinate is log v, else in v. Throws UsageError: not two numbers
  // in the parameter's range, the smaller first.
  NaturalRange(const Parameter& parameter, double low, double high);
  // All of the parameter's range where it has two bounds, else a factor of ten to both sides of its value. Throws
  // UsageError: neither makes sense.
  static NaturalRange of_scene(const Parameter& parameter);
  // The normal distribution of a prior (prior.h), cut off where it leaves one in two thousand on each side.
  static NaturalRange of_prior(const Coordinate& coordinate, double mean, double precision);

  const Parameter& parameter() const { return parameter_; }
  double low() const { return low_; }
  double high() const { return high_; }

  double of(double value) const;
  double value(double t) const;
  double slope(double t) const;  // d value / dt
  // Log of the density by t, up to a constant; inside of [-1, 1].
  double log_prior(double t) const;

 private:
  double natural(double value) const;

  Parameter parameter_;
  double low_, high_;
  bool logarithmic_ = false;
  double centre_ = 0, half_ = 1;  // of the natural coordinate
  double mean_ = 0, precision_ = 0;
};

// Returns the range of each parameter: between the two numbers that are given for its name, else of_prior() where it
// has a prior, else of_scene(). Throws UsageError: as these, where a parameter has both, or a given name is none of
// theirs.
std::vector<NaturalRange> natural_ranges(const std::vector<Coordinate>& coordinates, const Prior& prior,
                                         const std::map<std::string, std::pair<double, double>>& given);

}  // namespace itn
