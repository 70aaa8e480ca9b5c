#include "network/training/adam.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace itn {
namespace {

std::vector<Tensor> zeros_like(std::vector<Tensor> tensors) {
  for (Tensor& tensor : tensors) tensor.values.assign(tensor.values.size(), 0.0f);
  return tensors;
}

}  // namespace

Adam::Adam(const std::vector<Tensor>& weights, AdamOptions options)
    : options_(options), state_{zeros_like(weights), zeros_like(weights), 0} {}

void Adam::step(std::vector<Tensor>& weights, const std::vector<Tensor>& gradients, double learning_rate) {
  ++state_.steps;
  const auto steps = static_cast<double>(state_.steps);
  // The means start at 0; dividing by these takes that bias out of them.
  const double correction1 = 1 - std::pow(options_.beta1, steps), correction2 = 1 - std::pow(options_.beta2, steps);
  const auto keep1 = static_cast<float>(options_.beta1), add1 = static_cast<float>(1 - options_.beta1);
  const auto keep2 = static_cast<float>(options_.beta2), add2 = static_cast<float>(1 - options_.beta2);
  const auto rate = static_cast<float>(learning_rate / correction1);
  const auto root_scale = static_cast<float>(1 / std::sqrt(correction2));
  const auto epsilon = static_cast<float>(options_.epsilon);
  const auto kept = static_cast<float>(1 - learning_rate * options_.weight_decay);

  for (std::size_t i = 0; i < weights.size(); ++i) {
    float* const weight = weights[i].values.data();
    float* const mean = state_.mean[i].values.data();
    float* const mean_square = state_.mean_square[i].values.data();
    const float* const gradient = gradients[i].values.data();
    const float keep = weights[i].shape.size() > 1 ? kept : 1.0F;
    const auto count = static_cast<std::ptrdiff_t>(weights[i].values.size());
#pragma omp parallel for simd
    for (std::ptrdiff_t k = 0; k < count; ++k) {
      mean[k] = keep1 * mean[k] + add1 * gradient[k];
      mean_square[k] = keep2 * mean_square[k] + add2 * gradient[k] * gradient[k];
      weight[k] = keep * weight[k] - rate * mean[k] / (std::sqrt(mean_square[k]) * root_scale + epsilon);
    }
  }
}

double scheduled_learning_rate(double first, double last, std::uint64_t step, std::uint64_t steps) {
  if (step >= steps) return last;
  const double share = static_cast<double>(step) / static_cast<double>(steps);
  const double warm_up = std::min(1.0, 10 * static_cast<double>(step + 1) / static_cast<double>(steps));
  return warm_up * (last + (first - last) * 0.5 * (1 + std::cos(std::numbers::pi * share)));
}

}  // namespace itn
