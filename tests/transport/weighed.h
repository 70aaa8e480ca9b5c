// The sum of an image's values with a weight each: what gradients by replay are derivatives of.
#pragma once
#include <functional>
#include <numeric>
#include <vector>

#include "runtime/gradient_renderer.h"
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

inline WeighedDerivatives gradient(GradientRenderer& renderer, int first, int spp) {
  return renderer.render(first, {spp}, [](const std::vector<Rendering>& groups) {
    return std::vector<std::vector<double>>{weights_of(groups[0])};
  });
}

inline WeighedDerivatives gradient(const Scene& scene, const RenderOptions& options, int spp,
                                   const Device& on = device()) {
  GradientRenderer renderer(on, scene, options);
  return gradient(renderer, 0, spp);
}

inline double sum_of(const VoxelGrid& values) { return std::accumulate(values.data.begin(), values.data.end(), 0.0); }

}  // namespace itn::test
