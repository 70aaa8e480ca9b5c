#include "runtime/inversion/texture_inversion.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/error.h"

namespace itn {
namespace {

// At the ends of a range derivatives may be lost (a black texel brings no path), so texels keep a little off them.
// Voxels may be empty.
constexpr double share_kept_off = 1e-3;

struct Ends {
  double low, high;
};

Ends ends_of(const Parameter& p) {
  if (p.by_voxels) return {p.low, p.high};
  const double off = std::isfinite(p.high - p.low) ? share_kept_off * (p.high - p.low) : share_kept_off;
  return {p.low + off, p.high_included || !std::isfinite(p.high) ? p.high : p.high - off};
}

}  // namespace

double roughness_of(const VoxelGrid& values, double weight, double* gradient) {
  const auto width = static_cast<std::size_t>(values.width), height = static_cast<std::size_t>(values.height),
             depth = static_cast<std::size_t>(values.depth), channels = static_cast<std::size_t>(values.channels);
  const std::size_t row = width * channels, layer = row * height;
  const auto pairs = static_cast<double>(
      channels * ((width - 1) * height * depth + width * (height - 1) * depth + width * height * (depth - 1)));
  if (pairs == 0) return 0;
  double sum = 0;
  const auto add = [&](std::size_t a, std::size_t b) {
    const double d = static_cast<double>(values.data[a]) - static_cast<double>(values.data[b]);
    sum += d * d;
    gradient[a] += weight * 2 * d / pairs;
    gradient[b] -= weight * 2 * d / pairs;
  };
  for (std::size_t z = 0; z < depth; ++z)
    for (std::size_t y = 0; y < height; ++y)
      for (std::size_t i = 0; i < row; ++i) {
        const std::size_t at = z * layer + y * row + i;
        if (i + channels < row) add(at, at + channels);
        if (y + 1 < height) add(at, at + row);
        if (z + 1 < depth) add(at, at + layer);
      }
  return sum / pairs;
}

TextureInversion::TextureInversion(const Device& device, const Scene& scene, const std::vector<std::string>& parameters,
                                   const std::vector<int>& sensors, const std::vector<TargetImage>& targets,
                                   const RenderOptions& render_options, const TextureInversionOptions& options)
    : device_(device),
      scene_(scene),
      sensors_(sensors),
      targets_(targets),
      render_options_(render_options),
      options_(options) {
  const std::vector<Parameter> all = list_parameters(scene);
  for (const std::string& name : parameters) {
    parameters_.push_back(find_parameter(all, name));
    if (!parameters_.back().has_values())
      throw UsageError("parameter " + name + ": neither a bitmap nor a grid; need these alone, or numbers alone");
  }
  for (std::size_t t = 0; t < sensors.size(); ++t) {
    RenderOptions of_image = render_options;
    of_image.sensor = sensors[t];
    of_image.seed = render_options.seed + t;
    of_image.derivatives = parameters;
    renderers_.push_back(std::make_unique<GradientRenderer>(device, scene, of_image));
  }
}

TextureInversionState TextureInversion::start() const {
  TextureInversionState state;
  for (const Parameter& p : parameters_) {
    const Ends ends = ends_of(p);
    for (const float v : values_of(scene_, p).data)
      state.x.push_back(std::clamp(static_cast<double>(v), ends.low, ends.high));
  }
  return state;
}

std::vector<VoxelGrid> TextureInversion::textures(const TextureInversionState& state) const {
  std::vector<VoxelGrid> result;
  std::size_t at = 0;
  for (const Parameter& p : parameters_) {
    result.push_back(values_of(scene_, p));
    for (float& v : result.back().data) v = static_cast<float>(state.x[at++]);
  }
  return result;
}

Scene TextureInversion::scene_with(const TextureInversionState& state) const {
  Scene scene = scene_;
  std::vector<VoxelGrid> values = textures(state);
  for (std::size_t p = 0; p < values.size(); ++p) set_values(scene, parameters_[p], std::move(values[p]));
  return scene;
}

TextureInversionStep TextureInversion::advance(TextureInversionState& state) {
  const Scene scene = scene_with(state);
  std::vector<double> gradient(state.x.size());
  std::vector<LossGradient> losses;
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    renderers_[t]->replace(scene);
    const WeighedDerivatives derivatives = renderers_[t]->render(
        state.iteration * options_.spp, split_samples(options_.spp), [&](const std::vector<Rendering>& groups) {
          const double exposure = options_.exposure ? best_exposure(groups, targets_[t]) : 1;
          losses.push_back(loss_gradient(groups, targets_[t], exposure));
          return loss_weights(groups, targets_[t], exposure);
        });
    std::size_t at = 0;
    for (const VoxelGrid& of : derivatives.values)
      for (const float v : of.data) gradient[at++] += static_cast<double>(v) / static_cast<double>(targets_.size());
  }
  const LossGradient loss = mean_of(losses);
  TextureInversionStep step{state.iteration, loss.loss, loss.loss_stderr, 0};
  // Adam's step does not depend on the size of gradients, but for a small number beside them: texels of a large
  // picture must not come near it.
  double* of_texture = gradient.data();
  for (const VoxelGrid& values : textures(state)) {
    step.roughness += roughness_of(values, options_.smoothness, of_texture);
    of_texture += values.data.size();
  }
  for (double& g : gradient) g *= static_cast<double>(gradient.size());
  adam_step(state.x, gradient, state.moments, state.iteration, options_.iterations, options_.learning_rate);
  std::size_t at = 0;
  for (const Parameter& p : parameters_) {
    const Ends ends = ends_of(p);
    for (std::size_t i = values_of(scene_, p).data.size(); i > 0; --i, ++at)
      state.x[at] = std::clamp(state.x[at], ends.low, ends.high);
  }
  ++state.iteration;
  return step;
}

std::vector<Rendering> TextureInversion::render(const TextureInversionState& state, int spp, LossGradient* loss) const {
  const Scene scene = scene_with(state);
  std::vector<Rendering> images;
  std::vector<LossGradient> losses;
  const int first = options_.iterations * options_.spp;
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    RenderOptions of_image = render_options_;
    of_image.sensor = sensors_[t];
    of_image.seed = render_options_.seed + t;
    Renderer renderer(device_, scene, of_image);
    std::vector<Rendering> groups;
    int sample = first;
    for (const int samples : split_samples(spp)) {
      groups.push_back(renderer.render(sample, samples));
      sample += samples;
    }
    const double exposure = options_.exposure ? best_exposure(groups, targets_[t]) : 1;
    losses.push_back(loss_gradient(groups, targets_[t], exposure));
    images.push_back(renderer.render(first, spp));
    for (float& v : images.back().mean) v = static_cast<float>(exposure * static_cast<double>(v));
  }
  *loss = mean_of(losses);
  return images;
}

}  // namespace itn
