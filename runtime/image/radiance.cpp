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

std::string wrong_with_target(const std::vector<float>& values, const std::function<std::string(std::size_t)>& place) {
  if (std::string wrong = wrong_with_radiance(values); !wrong.empty()) return wrong;
  const double mean =
      std::accumulate(values.begin(), values.end(), 0.0) / std::max(1.0, static_cast<double>(values.size()));
  const auto low =
      std::find_if(values.begin(), values.end(), [&](float value) { return value < std::min(0.0, -mean); });
  if (low == values.end()) return "";
  return fmt::format("{} is {}, which noise around black is not: give the pixel weight 0 in a mask",
                     place(static_cast<std::size_t>(low - values.begin())), *low);
}

}  // namespace itn
