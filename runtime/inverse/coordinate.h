// The number that an optimizer changes in place of a parameter: unbounded, and with steps of similar meaning everywhere
// in the parameter's range. log p for numbers that cannot be 0 or have no upper bound (a refractive index of 1.5 is not
// on the edge of [0.001, 1000]), log((p - low) / (high - p)) for the others.
#pragma once
#include "itn/parameters.h"

namespace itn {

class Coordinate {
 public:
  explicit Coordinate(const Parameter& parameter);

  const Parameter& parameter() const { return parameter_; }
  // The coordinate of a value in the parameter's range; of one on its edge (with two bounds and no log: or nearer than
  // 1/400 of the range) that of a value just inside, where the image still changes with the coordinate. Throws
  // UsageError: outside of the range.
  double of(double value) const;
  // The parameter's value, strictly inside of its range, and its derivative by the coordinate.
  double value(double x) const;
  double slope(double x) const;
  // One of several starts, for u in [0, 1]: up to a factor of four from the parameter's own value, or in the inner four
  // fifths of the range.
  double start(double u) const;
  // The nearest coordinate that float numbers tell from the edge of the range.
  double clamp(double x) const;
  bool at_edge(double x) const;

 private:
  Parameter parameter_;
  bool logarithmic_;
  double least_, most_;  // coordinates
};

}  // namespace itn
