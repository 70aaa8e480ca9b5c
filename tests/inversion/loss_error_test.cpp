// The standard errors of a loss and its gradient are those of their spread.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "runtime/inverse/image_loss.h"

using namespace itn;

namespace {

constexpr int side = 16;
constexpr std::size_t pixels = side * side, channels = 3;

// Samples of a colour and of its derivative, each channel with the others' noise: what a path brings.
std::vector<Rendering> made_up(int spp, double noise, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<Rendering> groups;
  for (const int samples : split_samples(spp)) {
    Rendering r;
    r.width = r.height = side;
    r.channels = static_cast<int>(channels);
    r.spp = samples;
    r.mean.assign(pixels * channels, 0.0F);
    r.derivatives.resize(1);
    r.derivatives[0].mean = r.mean;
    for (std::size_t p = 0; p < pixels; ++p)
      for (int s = 0; s < samples; ++s) {
        const double shared = normal(random);
        for (std::size_t c = 0; c < channels; ++c) {
          const double n = 0.7 * shared + 0.7 * normal(random);
          // Skewed, as radiance is.
          const double value = 1 + noise * (std::exp(0.5 * n) - std::exp(0.125));
          r.mean[p * channels + c] += static_cast<float>(value / samples);
          r.derivatives[0].mean[p * channels + c] +=
              static_cast<float>((0.5 + noise * (0.6 * n + 0.8 * normal(random))) / samples);
        }
      }
    groups.push_back(std::move(r));
  }
  return groups;
}

}  // namespace

TEST_CASE("standard errors of a loss and its gradient are within 10 % from 4 samples a pixel on") {
  const int spp = GENERATE(4, 5, 16, 24, 37);
  const double noise = GENERATE(0.1, 2.0);  // the target, or the noise alone, makes the loss
  CAPTURE(spp, noise);
  TargetImage target{side,
                     side,
                     static_cast<int>(channels),
                     std::vector<float>(pixels * channels, 0.8F),
                     std::vector<float>(pixels, 1.0F),
                     {}};
  std::mt19937_64 random(static_cast<std::uint64_t>(spp));
  constexpr int repeats = 500;  // whose spread is known to 3 %
  std::array<double, 2> sum{}, square{}, variance{};
  for (int i = 0; i < repeats; ++i) {
    const LossGradient found = loss_gradient(made_up(spp, noise, random), target, 1);
    const std::array values{found.loss, found.gradient[0]}, errors{found.loss_stderr, found.gradient_stderr[0]};
    for (std::size_t k = 0; k < 2; ++k) {
      sum[k] += values[k];
      square[k] += values[k] * values[k];
      variance[k] += errors[k] * errors[k] / repeats;
    }
  }
  for (std::size_t k = 0; k < 2; ++k) {
    const double spread = std::sqrt((square[k] - sum[k] * sum[k] / repeats) / (repeats - 1));
    CAPTURE(k, spread, std::sqrt(variance[k]));
    CHECK(std::sqrt(variance[k]) / spread == Approx(1).margin(0.1));
  }
}

TEST_CASE("an error from three samples is the jackknife's, and of two it is not known") {
  std::mt19937_64 random(1);
  const TargetImage target{side,
                           side,
                           static_cast<int>(channels),
                           std::vector<float>(pixels * channels, 0.8F),
                           std::vector<float>(pixels, 1.0F),
                           {}};
  const LossGradient of_three = loss_gradient(made_up(3, 1, random), target, 1);
  CHECK((of_three.loss_stderr > 0 && std::isfinite(of_three.loss_stderr)));
  CHECK(std::isinf(loss_gradient(made_up(2, 1, random), target, 1).loss_stderr));
}
