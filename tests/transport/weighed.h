// The sum of an image's values with a weight each: what gradients by replay are derivatives of.
#pragma once
#include <functional>
#include <numeric>
#include <vector>

#include "itn/gradient_renderer.h"
#include "runtime/inverse/image_loss.h"
#include "transport.h"

namespace itn::test {

inline std::vector<double> weights_of(const Rendering& image) {
  std::vector<double> weights(image.mean.size());
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = 0.5 + 0.1 * static_cast<double>(i * 5 % 13);
  return weights;
}

inline double weighed(const Scene& scene, RenderOptions options, int spp) {
  options.derivatives.clear();
  const Rendering image = Renderer(device(), scene, options).render(0, spp);
  const std::vector<double> weights = weights_of(image);
  return std::inner_product(weights.begin(), weights.end(), image.mean.begin(), 0.0, std::plus<>(),
                            [](double w, float v) { return w * static_cast<double>(v); });
}

// Weights that do not depend on the samples, with a contrast between four of the groups.
inline GradientWeights fixed_weights(const std::vector<Rendering>& groups, const std::vector<double>& weights) {
  const std::size_t compared = std::min<std::size_t>(groups.size(), 4);  // they tell the variance of a sample
  double samples = 0;
  for (const Rendering& group : groups) samples += group.spp;
  const auto times = [&](double factor) {
    std::vector<double> scaled(weights);
    for (double& weight : scaled) weight *= factor;
    return scaled;
  };
  GradientWeights result({});
  GradientContrast contrast;
  double variance = 0;  // of the contrast, over that of a sample
  for (std::size_t g = 0; g < groups.size(); ++g) {
    result.values.push_back(times(groups[g].spp / samples));
    contrast.weights.emplace_back();
    if (g >= compared) continue;
    // They add up to 0.
    const double sign = (g % 2 == 0 ? 1.0 : -1.0) - static_cast<double>(compared % 2) / static_cast<double>(compared);
    contrast.weights.back() = times(sign);
    variance += sign * sign / groups[g].spp;
  }
  contrast.factor = 1 / samples / variance;
  if (compared > 1) result.contrasts.push_back(std::move(contrast));
  return result;
}

inline WeighedDerivatives gradient(GradientRenderer& renderer, int first, int spp) {
  return renderer.render(first, split_samples(spp), [](const std::vector<Rendering>& groups) {
    return fixed_weights(groups, weights_of(groups[0]));
  });
}

inline WeighedDerivatives gradient(const Scene& scene, const RenderOptions& options, int spp,
                                   const Device& on = device()) {
  GradientRenderer renderer(on, scene, options);
  return gradient(renderer, 0, spp);
}

inline double sum_of(const VoxelGrid& values) { return std::accumulate(values.data.begin(), values.data.end(), 0.0); }

}  // namespace itn::test
