#include <numbers>

#include "itn/colour.h"
#include "runtime/render/compile/environment/fill.h"

namespace itn {

void constant_fill(const Environment& environment, EnvironmentRecord& record, std::vector<float>& /*tables*/) {
  const Rgb& radiance = environment.colour("radiance");
  for (std::size_t c = 0; c < 3; ++c) {
    require(not_negative(radiance[c]), environment, "radiance", "finite and not negative", radiance[c]);
    record.radiance[c] = static_cast<float>(radiance[c]);
  }
  record.sky_weight = static_cast<float>(4 * std::numbers::pi * luminance(radiance));
}

void constant_move(const Environment& /*environment*/, const Parameter& p, EnvironmentRecord& moving,
                   std::vector<float>& /*tables*/) {
  move_radiance(p, moving);
}

}  // namespace itn
