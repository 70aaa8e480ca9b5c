#include "tools/itn/bench/texture_gradients.h"

#include <cmath>

#include "itn/gradient_renderer.h"
#include "itn/parameters.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

// Sums over several gradients.
class Gradients {
 public:
  // values: of the texels
  void add(double seconds, const std::vector<float>& texels, const std::vector<float>& values) {
    seconds_.push_back(seconds);
    mean_.resize(texels.size());
    square_.resize(texels.size());
    double sum = 0;
    for (std::size_t i = 0; i < texels.size(); ++i) {
      if (values[i] == 0) continue;
      const double x = static_cast<double>(texels[i]);
      sum += x * static_cast<double>(values[i]);
      mean_[i] += x;
      square_[i] += x * x;
    }
    sums_.push_back(sum);
  }

  TexelGradient summary() const {
    const auto n = static_cast<double>(sums_.size());
    TexelGradient result;
    result.seconds = median(seconds_);
    double spread = 0;
    for (const double sum : sums_) result.sum += sum / n;
    for (const double sum : sums_) spread += (sum - result.sum) * (sum - result.sum) / (n - 1);
    result.stderr_ = std::sqrt(spread / n);
    for (std::size_t i = 0; i < mean_.size(); ++i) result.variance += (square_[i] - mean_[i] * mean_[i] / n) / (n - 1);
    return result;
  }

 private:
  std::vector<double> seconds_, sums_, mean_, square_;
};

}  // namespace

TextureGradientCost texture_gradient_cost(const Device& device, const Scene& scene, const std::string& file,
                                          const std::string& texture, RenderOptions options, int runs,
                                          MitsubaPeer* peer) {
  const std::uint64_t seed = options.seed;
  const std::vector<float> values = values_of(scene, find_parameter(list_parameters(scene), texture)).data;
  std::vector<double> value_s;
  Gradients ours, others;
  for (int run = 0; run <= runs; ++run) {
    options.seed = seed + static_cast<std::uint64_t>(run);
    options.derivatives.clear();
    const Rendering value = render(device, scene, options);
    options.derivatives = {texture};
    const WeighedDerivatives gradient =
        GradientRenderer(device, scene, options).render(0, {value.spp}, [](const std::vector<Rendering>& groups) {
          const std::size_t size = groups[0].mean.size();
          return std::vector<std::vector<double>>(1, std::vector<double>(size, 1 / static_cast<double>(size)));
        });
    if (run > 0) {
      value_s.push_back(value.render_s);
      ours.add(gradient.render_s, gradient.values[0].data, values);
    }
    if (!peer) continue;
    const PeerImage theirs = peer->differentiate_by_texels(file, texture, value.spp, options.seed);
    if (run > 0) others.add(theirs.seconds, theirs.pixels, values);
  }
  TextureGradientCost cost;
  cost.value_s = median(value_s);
  cost.ours = ours.summary();
  if (peer) cost.peer = others.summary();
  return cost;
}

}  // namespace itn
