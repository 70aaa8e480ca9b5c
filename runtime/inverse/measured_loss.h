// The image loss of a scene's image and its gradient, by the quicker of two methods with the same mean: derivative
// images or replayed paths.
#pragma once
#include <functional>
#include <vector>

#include "itn/gradient_renderer.h"
#include "runtime/inverse/image_loss.h"

namespace itn {

struct MeasuredLoss {
  LossGradient loss;
  std::vector<VoxelGrid> values;  // as of WeighedDerivatives
  double trace_s = 0;             // of replayed paths
  double exposure = 1;
};

// Derivative images take time for each parameter, replayed paths for none: beyond this many they are quicker
// (tools/README.md).
constexpr std::size_t most_derivative_images = 12;

// Renders samples first_sample ... first_sample + spp - 1, spp >= 2. exposure: the target is known up to a factor.
// errors: as in loss_gradient(). progress, may be empty: called with the fraction done. Throws as the renderer, and
// best_exposure().
MeasuredLoss measure_loss(Renderer& renderer, int first_sample, int spp, const TargetImage& target, bool exposure,
                          const std::function<void(double)>& progress, bool errors = true);
MeasuredLoss measure_loss(GradientRenderer& renderer, int first_sample, int spp, const TargetImage& target,
                          bool exposure, bool errors = true);

}  // namespace itn
