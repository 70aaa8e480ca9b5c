// The range and the scale of a parameter's slider.
#pragma once
#include <string>

#include "itn/parameters.h"

namespace itn {

// A slider at place t in [0, 1] has the value
//   linear      low + (high - low) t,
//   logarithm   low (high / low)^t,
//   from_low    low + (high - low) t^3: finest near the lower end, which is reached,
//   to_high     high - (high - low) (1 - t)^3: the same at the upper end.
struct Slider {
  enum class Scale { linear, logarithm, from_low, to_high } scale = Scale::linear;
  double low = 0, high = 1;

  double value(double t) const;
};

// Within the parameter's range, around its value. What has no upper bound ends eight times higher, with the value in
// the middle; a medium's albedo, whose effect grows without bound towards 1, is finest there.
Slider slider_of(const Parameter& parameter);

std::string name_of(Slider::Scale scale);

}  // namespace itn
