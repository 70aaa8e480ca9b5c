#include "runtime/image/radiance.h"

#include <fmt/format.h>

#include <cmath>

namespace itn {

std::string wrong_with_radiance(const std::vector<float>& values) {
  double above = 0, below = 0;
  for (const float value : values) (value > 0 ? above : below) += std::fabs(static_cast<double>(value));
  constexpr double most_below = 0.1;
  if (!(below > most_below * above)) return "";
  return fmt::format(
      "its values below 0 add up to {:.3g} of those above; need radiance, of which only noise around "
      "black is below 0: is it a difference, or is black subtracted wrongly?",
      below / above);
}

}  // namespace itn
