#include "runtime/inverse/measured_loss.h"

#include <utility>

namespace itn {

MeasuredLoss measure_loss(Renderer& renderer, int first_sample, int spp, const TargetImage& target, bool exposure,
                          const std::function<void(double)>& progress, bool errors) {
  std::vector<Rendering> groups;
  int done = 0;
  for (const int samples : split_samples(spp)) {
    groups.push_back(renderer.render(first_sample + done, samples));
    done += samples;
    if (progress) progress(static_cast<double>(done) / spp);
  }
  MeasuredLoss result;
  if (exposure) result.exposure = best_exposure(groups, target);
  result.loss = loss_gradient(groups, target, result.exposure, errors);
  return result;
}

MeasuredLoss measure_loss(GradientRenderer& renderer, int first_sample, int spp, const TargetImage& target,
                          bool exposure, bool errors) {
  MeasuredLoss result;
  WeighedDerivatives gradient =
      renderer.render(first_sample, split_samples(spp), [&](const std::vector<Rendering>& groups) {
        if (exposure) result.exposure = best_exposure(groups, target);
        result.loss = loss_gradient(groups, target, result.exposure, errors);
        return loss_weights(groups, target, result.exposure, errors);
      });
  result.loss.gradient = gradient.value;
  result.loss.gradient_stderr = gradient.stderr_;
  result.values = std::move(gradient.values);
  result.trace_s = gradient.render_s;
  return result;
}

}  // namespace itn
