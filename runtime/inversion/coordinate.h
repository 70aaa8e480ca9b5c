// The number that an optimizer changes in place of a parameter: unbounded, and with steps of similar meaning everywhere
// in the parameter's range. log p for p > 0, log((p - low) / (high - p)) for p between two bounds.
#pragma once
#include "runtime/scene/parameters.h"

namespace itn {

class Coordinate {
 public:
  explicit Coordinate(const Parameter& parameter);

  const Parameter& parameter() const { return parameter_; }
  // The coordinate of a value in the parameter's range; of one on its edge (or nearer than 1/400 of the range) that of
  // a value just inside, where the image still changes with the coordinate. Throws UsageError: outside of the range.
  double of(double value) const;
  // The parameter's value, strictly inside of its range, and its derivative by the coordinate.
  double value(double x) const;
  double slope(double x) const;
  // The nearest coordinate that float numbers tell from the edge of the range.
  double clamp(double x) const;
  bool at_edge(double x) const;

 private:
  bool bounded() const;
  Parameter parameter_;
};

}  // namespace itn
