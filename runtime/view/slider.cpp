#include "runtime/view/slider.h"

#include <algorithm>
#include <cmath>

namespace itn {

double Slider::value(double t) const {
  switch (scale) {
    case Scale::linear:
      return low + (high - low) * t;
    case Scale::logarithm:
      return low * std::pow(high / low, t);
    case Scale::from_low:
      return low + (high - low) * t * t * t;
    case Scale::to_high:
      return high - (high - low) * (1 - t) * (1 - t) * (1 - t);
  }
  return low;
}

Slider slider_of(const Parameter& p) {
  constexpr double just_inside = 1e-3;  // of the range, where its end does not belong to it
  constexpr double wide = 100;          // a range that spans more is looked at in factors
  Slider slider;
  if (!std::isfinite(p.low)) {
    constexpr double least = 0.25;
    const double most = 4 * std::max(std::fabs(p.value), least);
    return {Slider::Scale::linear, -most, std::min(most, p.high)};
  }
  if (!std::isfinite(p.high)) {
    const double top = p.value > p.low ? 8 * (p.value - p.low) : 1;  // (1 / 2)^3 of it is the value
    slider = {Slider::Scale::from_low, p.low, p.low + top};
    if (!p.low_included) slider.low += just_inside * top;
    return slider;
  }
  if (p.low > 0 && p.high > wide * p.low) {
    constexpr double factor = 4;
    return {Slider::Scale::logarithm, std::max(p.low, p.value / factor), std::min(p.high, p.value * factor)};
  }
  const double width = p.high - p.low;
  slider = {Slider::Scale::linear, p.low, p.high};
  if (p.low == 0 && p.high > wide)  // such as a metal's index of refraction
    slider.high = std::min(p.high, 4 * std::max(p.value, 1.0));
  if (!p.low_included) slider.low += just_inside * width;
  if (!p.high_included) slider.high -= just_inside * width;
  if (p.is(Owner::medium, "albedo")) slider.scale = Slider::Scale::to_high;
  return slider;
}

std::string name_of(Slider::Scale scale) {
  switch (scale) {
    case Slider::Scale::linear:
      return "linear";
    case Slider::Scale::logarithm:
      return "logarithm";
    case Slider::Scale::from_low:
      return "from_low";
    case Slider::Scale::to_high:
      return "to_high";
  }
  return "";
}

}  // namespace itn
