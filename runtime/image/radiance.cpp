#include "runtime/image/radiance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

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

std::optional<std::size_t> far_below_black(const std::vector<float>& values) {
  const double mean =
      std::accumulate(values.begin(), values.end(), 0.0) / std::max(1.0, static_cast<double>(values.size()));
  const auto found =
      std::find_if(values.begin(), values.end(), [&](float value) { return value < std::min(0.0, -mean); });
  if (found == values.end()) return {};
  return static_cast<std::size_t>(found - values.begin());
}

}  // namespace itn
