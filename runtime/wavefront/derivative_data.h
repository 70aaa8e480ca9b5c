// Parameters by which an image is differentiated, as the records and the code that the device needs for it.
#pragma once
#include <string>
#include <vector>

#include "kernels/shared/scene_layout.h"
#include "runtime/derivative/score_functions.h"
#include "runtime/scene/scene.h"

namespace itn {

static_assert(sizeof(ScoreRecord) == 12 && sizeof(DerivativeRecord) == 24);

struct DerivativeData {
  std::vector<ScoreRecord> scores;            // what a path carries
  std::vector<DerivativeRecord> derivatives;  // one a parameter, in the order of the names
  ScoreRequest functions;                     // the derivatives of the models that it takes
};

// names: as list_parameters gives them. Throws UsageError: unknown, not differentiable (says why), or named twice.
DerivativeData derivative_data(const Scene& scene, const std::vector<std::string>& names);

}  // namespace itn
