// Parameters by which an image is differentiated, as the records and the code that the device needs for it.
#pragma once
#include <string>
#include <vector>

#include "kernels/shared/scene_layout.h"
#include "runtime/derivative/score_functions.h"
#include "runtime/scene/scene.h"
#include "runtime/wavefront/launch_data.h"

namespace itn {

static_assert(sizeof(ScoreRecord) == 12 && sizeof(DerivativeRecord) == 16);

struct DerivativeData {
  std::vector<ScoreRecord> scores;            // what a path carries
  std::vector<PartRecord> parts;              // of the derivatives, which are in the order of the names
  std::vector<DerivativeRecord> derivatives;  // one a part
  int images() const { return parts.empty() ? 0 : parts.back().image + 1; }
  ScoreRequest functions;  // the derivatives of the models that it takes
};

// names: as list_parameters gives them; emitter: the scene's light in `launch`, to which the derivatives of that light
// are appended. Throws UsageError: a name that is unknown, not differentiable (says why), or there twice.
DerivativeData derivative_data(const Scene& scene, const std::vector<std::string>& names, int emitter,
                               LaunchData& launch);

}  // namespace itn
