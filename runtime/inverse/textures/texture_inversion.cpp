#include "runtime/inverse/textures/texture_inversion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "itn/error.h"
#include "itn/parameter_kind.h"
#include "runtime/base/random.h"
#include "runtime/base/sample_index.h"
#include "runtime/image/accumulation.h"

namespace itn {
namespace {

// At the ends of a range derivatives may be lost (a black texel brings no path), so texels keep a little off them.
// Voxels may be empty; from a bound that is not included they keep as far as scene files must.
constexpr double share_kept_off = 1e-3;

struct Ends {
  double low, high;
};

Ends ends_of(const Parameter& p) {
  if (p.by_voxels)
    return {p.low + (p.low_included ? 0 : least_distance_from_bound),
            p.high - (p.high_included ? 0 : least_distance_from_bound)};
  const double off = std::isfinite(p.high - p.low) ? share_kept_off * (p.high - p.low) : share_kept_off;
  return {p.low + off, p.high_included || !std::isfinite(p.high) ? p.high : p.high - off};
}

// Step size at the beginning of the last quarter of the iterations, as a share of the greatest (adam_step.h): (1 + cos
// 135) / 2.
constexpr double rate_of_last_quarter = 0.1464466;

// Samples of the images at the end.
constexpr int least_final_samples = 64;
int final_samples(const TextureInversionOptions& options) { return std::max(least_final_samples, options.spp); }

// Seed for the noise of the repetitions, apart from the seeds of rendering, which count from the same one.
std::uint64_t noise_seed(std::uint64_t seed) { return mixed_bits(seed ^ 0x6e6f697379ULL); }

}  // namespace

std::string words(const TextureImages& seen) {
  if (seen.fit()) return words(seen.comparison.fit);
  return fmt::format(
      "{} (It has {:.3g} times the variance of the noise; where the loss still falls, more iterations or samples "
      "help.)",
      misfit_words(seen.comparison), seen.comparison.fit.chi_square);
}

double roughness_of(const VoxelGrid& values, bool all_around, double weight, double* gradient) {
  const auto width = static_cast<std::size_t>(values.width), height = static_cast<std::size_t>(values.height),
             depth = static_cast<std::size_t>(values.depth), channels = static_cast<std::size_t>(values.channels);
  const std::size_t row = width * channels, layer = row * height;
  const std::size_t steps = all_around ? width : width - 1;
  const auto pairs = static_cast<double>(
      channels * (steps * height * depth + width * (height - 1) * depth + width * height * (depth - 1)));
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
        if (i + channels >= row && all_around) add(at, at + channels - row);
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
  std::size_t first = 0;
  for (const std::string& name : parameters) {
    const Parameter p = find_parameter(all, name);
    Unknown unknown{p, {}, {}, first, 1};
    if (p.has_values()) {
      if (options.smoothness > 0 && p.by_texels && !is_picture(scene, p))
        throw UsageError("parameter " + name +
                         ": an attribute of meshes has no neighbours that could be alike; need smoothness 0");
      unknown.start = values_of(scene, p);
      unknown.count = unknown.start.data.size();
    } else {
      if (!p.not_differentiable.empty())
        throw UsageError("parameter " + name + " cannot be found: " + p.not_differentiable);
      unknown.coordinate.emplace(p);
    }
    first += unknown.count;
    unknowns_.push_back(std::move(unknown));
  }
  for (std::size_t t = 0; t < sensors.size(); ++t) {
    RenderOptions of_image = render_options;
    of_image.sensor = sensors[t];
    of_image.seed = render_options.seed + t;
    of_image.derivatives = parameters;
    renderers_.push_back(std::make_unique<GradientRenderer>(device, scene, of_image));
  }
}

std::vector<Parameter> TextureInversion::parameters() const {
  std::vector<Parameter> result;
  for (const Unknown& unknown : unknowns_) result.push_back(unknown.parameter);
  return result;
}

TextureInversionState TextureInversion::start() const {
  TextureInversionState state;
  for (const Unknown& unknown : unknowns_) {
    if (unknown.coordinate) {
      state.x.push_back(unknown.coordinate->of(unknown.parameter.value));
      continue;
    }
    const Ends ends = ends_of(unknown.parameter);
    for (const float v : unknown.start.data) state.x.push_back(std::clamp(static_cast<double>(v), ends.low, ends.high));
  }
  return state;
}

VoxelGrid TextureInversion::values_of_unknown(const Unknown& unknown, const std::vector<double>& values) const {
  VoxelGrid result = unknown.start;
  for (std::size_t i = 0; i < unknown.count; ++i) result.data[i] = static_cast<float>(values[unknown.first + i]);
  return result;
}

VoxelGrid TextureInversion::values(const TextureInversionState& state, std::size_t parameter) const {
  return values_of_unknown(unknowns_.at(parameter), state.x);
}

VoxelGrid TextureInversion::uncertainty(const TextureInversionState& state, std::size_t parameter) const {
  std::vector<double> errors;
  for (const double square : state.squares) errors.push_back(std::sqrt(square / options_.repeats));
  return values_of_unknown(unknowns_.at(parameter), errors);
}

double TextureInversion::number(const TextureInversionState& state, std::size_t parameter,
                                double standard_errors) const {
  const Unknown& unknown = unknowns_.at(parameter);
  const double error = standard_errors == 0 ? 0 : std::sqrt(state.squares.at(unknown.first) / options_.repeats);
  return unknown.coordinate->value(state.x[unknown.first] + standard_errors * error);
}

Scene TextureInversion::scene_with(const std::vector<double>& x) const {
  Scene scene = scene_;
  for (const Unknown& unknown : unknowns_) {
    if (unknown.coordinate)
      set_parameter(scene, unknown.parameter, unknown.coordinate->value(x[unknown.first]));
    else
      set_values(scene, unknown.parameter, values_of_unknown(unknown, x));
  }
  return scene;
}

int TextureInversion::iterations_of_repeat() const { return std::max(1, options_.iterations / 4); }

int TextureInversion::first_sample(int repeat, int iteration) const {
  const std::int64_t spp = options_.spp;
  if (repeat == 0) return following_sample(0, iteration * spp);
  const std::int64_t before = options_.iterations + (repeat - 1) * std::int64_t{iterations_of_repeat()};
  return following_sample(0, (before + iteration) * spp + final_samples(options_));
}

const std::vector<TargetImage>& TextureInversion::targets_of(int repeat) {
  if (repeat == 0) return targets_;
  if (noisy_repeat_ == repeat) return noisy_;
  noisy_ = targets_;
  noisy_repeat_ = repeat;
  const std::uint64_t seed = noise_seed(render_options_.seed);
  for (std::size_t t = 0; t < noisy_.size(); ++t)
    for (std::size_t i = 0; i < noisy_[t].value.size(); ++i) {
      const auto value = static_cast<double>(targets_[t].value[i]);
      const double stated = targets_[t].error.empty() ? 0 : static_cast<double>(targets_[t].error[i]);
      const double camera = targets_[t].noise.empty() ? 0 : static_cast<double>(targets_[t].noise[i]);
      const double noise = std::hypot(stated, camera, options_.relative_noise * value);
      const auto stream = static_cast<std::uint64_t>(repeat) << 32U | t;
      noisy_[t].value[i] = static_cast<float>(value + noise * random_normal(seed, stream, i));
    }
  return noisy_;
}

std::vector<double> TextureInversion::gradient(const TextureInversionState& state, LossGradient* loss) {
  const Scene scene = scene_with(state.x);
  const std::vector<TargetImage>& targets = targets_of(state.repeat);
  std::vector<double> result(state.x.size());
  std::vector<LossGradient> losses;
  for (std::size_t t = 0; t < targets.size(); ++t) {
    renderers_[t]->replace(scene);
    const WeighedDerivatives by =
        renderers_[t]->render(first_sample(state.repeat, state.iteration), split_samples(options_.spp),
                              [&](const std::vector<Rendering>& groups) {
                                const double exposure = options_.exposure ? best_exposure(groups, targets[t]) : 1;
                                losses.push_back(loss_gradient(groups, targets[t], exposure));
                                return loss_weights(groups, targets[t], exposure, false);
                              });
    const auto count = static_cast<double>(targets.size());
    for (std::size_t p = 0; p < unknowns_.size(); ++p) {
      const Unknown& unknown = unknowns_[p];
      if (unknown.coordinate)
        result[unknown.first] += by.value[p] * unknown.coordinate->slope(state.x[unknown.first]) / count;
      else
        for (std::size_t i = 0; i < unknown.count; ++i)
          result[unknown.first + i] += static_cast<double>(by.values[p].data[i]) / count;
    }
  }
  *loss = mean_of(losses);
  return result;
}

double TextureInversion::add_roughness(const std::vector<double>& x, std::vector<double>& gradient) const {
  double sum = 0;
  for (const Unknown& unknown : unknowns_)
    if (!unknown.coordinate)
      sum += roughness_of(values_of_unknown(unknown, x), unknown.parameter.owner == Owner::environment,
                          options_.smoothness, gradient.data() + unknown.first);
  return sum;
}

TextureInversionStep TextureInversion::advance(TextureInversionState& state) {
  LossGradient loss;
  std::vector<double> by = gradient(state, &loss);
  TextureInversionStep step{state.repeat, state.iteration, loss.loss, loss.loss_stderr, 0};
  step.roughness = add_roughness(state.x, by);
  // Adam's step does not depend on the size of gradients, but for a small number beside them: texels of a large
  // picture must not come near it.
  for (double& g : by) g *= static_cast<double>(by.size());
  const int iterations = state.repeat == 0 ? options_.iterations : iterations_of_repeat();
  const double rate = options_.learning_rate * (state.repeat == 0 ? 1 : rate_of_last_quarter);
  adam_step(state.x, by, state.moments, state.iteration, iterations, rate);
  for (const Unknown& unknown : unknowns_) {
    const Ends ends = ends_of(unknown.parameter);
    for (std::size_t i = unknown.first; i < unknown.first + unknown.count; ++i)
      state.x[i] =
          unknown.coordinate ? unknown.coordinate->clamp(state.x[i]) : std::clamp(state.x[i], ends.low, ends.high);
  }
  if (++state.iteration == iterations) end_repeat(state);
  return step;
}

void TextureInversion::end_repeat(TextureInversionState& state) const {
  if (state.repeat == 0) {
    state.found = state.x;
    state.squares.assign(state.x.size(), 0);
    for (std::size_t i = 0; i < state.x.size(); ++i)  // of what no path has seen nothing is known
      if (state.moments.second[i] == 0) state.squares[i] = std::numeric_limits<double>::infinity();
  } else {
    for (std::size_t i = 0; i < state.x.size(); ++i)
      state.squares[i] += (state.x[i] - state.found[i]) * (state.x[i] - state.found[i]);
  }
  state.x = state.found;
  state.finished = state.repeat == options_.repeats;
  if (state.finished) return;
  ++state.repeat;
  state.iteration = 0;
  state.moments = {};
}

TextureImages TextureInversion::render(const TextureInversionState& state) const {
  const Scene scene = scene_with(state.x);
  TextureImages result;
  std::vector<LossGradient> losses;
  std::vector<std::vector<Rendering>> groups(targets_.size());
  std::vector<double> exposures;
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    RenderOptions of_image = render_options_;
    of_image.sensor = sensors_[t];
    of_image.seed = render_options_.seed + t;
    Renderer renderer(device_, scene, of_image);
    Accumulation all;
    int sample = following_sample(0, std::int64_t{options_.iterations} * options_.spp);
    for (const int samples : split_samples(final_samples(options_))) {
      groups[t].push_back(renderer.render(sample, samples));
      all.add(groups[t].back());
      sample += samples;
    }
    exposures.push_back(options_.exposure ? best_exposure(groups[t], targets_[t]) : 1);
    losses.push_back(loss_gradient(groups[t], targets_[t], exposures[t]));
    result.images.push_back(all.rendering());
    for (float& v : result.images.back().mean) v = static_cast<float>(exposures[t] * static_cast<double>(v));
  }
  result.loss = mean_of(losses);
  result.comparison = compare_images(groups, targets_, exposures, options_.exposure, options_.relative_noise,
                                     options_.noise_known, true);
  return result;
}

}  // namespace itn
