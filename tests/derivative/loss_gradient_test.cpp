// The image loss and its gradient from few samples: the right mean, the right standard error; and how far off the usual
// product of image and derivative image is.
#include <catch2/catch.hpp>
#include <cmath>

#include "itn/error.h"
#include "runtime/inverse/image_loss.h"
#include "tests/stage/scenes.h"
#include "tests/stage/stage_test.h"

using namespace itn;
using namespace itn::test;

namespace {

Scene small_sphere() {
  Scene scene = sphere_scene(bsdf_of("null"), medium_of(4, 0.8, 0.4));
  scene.media[0].id = "medium";
  scene.media[0].phase.id = "phase";
  Sensor& sensor = scene.sensors[0];
  sensor.width = sensor.height = sensor.crop_width = sensor.crop_height = 6;
  sensor.luminance = true;
  sensor.to_world.m = {1, 0, 0, 0, 0, 0, 1, -4, 0, 1, 0, 0, 0, 0, 0, 1};
  return scene;
}

TargetImage grey_target(float value) {
  return {6, 6, 1, std::vector<float>(36, value), std::vector<float>(36, 1.0F), {}};
}

// The estimate of most code: T and dT from the same samples, multiplied.
double product_of_means(const std::vector<Rendering>& groups, const TargetImage& target, std::size_t parameter) {
  double sum = 0;
  for (std::size_t i = 0; i < target.value.size(); ++i) {
    double n = 0, t = 0, d = 0;
    for (const Rendering& group : groups) {
      n += group.spp;
      t += group.spp * static_cast<double>(group.mean[i]);
      d += group.spp * static_cast<double>(group.derivatives[parameter].mean[i]);
    }
    sum += 2 * (t / n - static_cast<double>(target.value[i])) * d / n;
  }
  return sum / static_cast<double>(target.value.size());
}

struct Moments {
  double n = 0, mean = 0, square = 0;
  void add(double x) {
    n += 1;
    const double delta = x - mean;
    mean += delta / n;
    square += delta * (x - mean);
  }
  double variance() const { return square / (n - 1); }
  double stderr_of_mean() const { return std::sqrt(variance() / n); }
};

}  // namespace

TEST_CASE("loss and gradient from 2, 4, 8 and 32 samples have the mean of many samples, with true standard errors",
          "[stat]") {
  const Scene scene = small_sphere();
  const TargetImage target = grey_target(0.5F);
  RenderOptions options;
  options.derivatives = {"medium.sigma_t", "medium.albedo", "phase.g"};
  options.seed = 11;
  Renderer renderer(device(), scene, options);
  int next = 0;
  const auto sample = [&](int spp) {
    std::vector<Rendering> groups;
    for (const int samples : split_samples(spp)) {
      groups.push_back(renderer.render(next, samples));
      next += samples;
    }
    return groups;
  };
  const LossGradient exact = loss_gradient(sample(1 << 17), target);
  constexpr int repeats = 200;
  constexpr double bound = 4.2;  // 32 tests of 2.7 in 10^5
  for (const int spp : {2, 4, 8, 32}) {
    std::vector<Moments> values(4), naive(3), claimed(4);
    for (int r = 0; r < repeats; ++r) {
      const std::vector<Rendering> groups = sample(spp);
      const LossGradient found = loss_gradient(groups, target);
      values[0].add(found.loss);
      claimed[0].add(found.loss_stderr * found.loss_stderr);
      for (std::size_t p = 0; p < 3; ++p) {
        values[1 + p].add(found.gradient[p]);
        claimed[1 + p].add(found.gradient_stderr[p] * found.gradient_stderr[p]);
        naive[p].add(product_of_means(groups, target, p));
      }
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const double truth = k == 0 ? exact.loss : exact.gradient[k - 1];
      const double error = k == 0 ? exact.loss_stderr : exact.gradient_stderr[k - 1];
      INFO(spp << " samples, " << (k == 0 ? "loss" : options.derivatives[k - 1]) << ": mean " << values[k].mean
               << " +- " << values[k].stderr_of_mean() << ", many samples " << truth << " +- " << error);
      CHECK(std::abs(values[k].mean - truth) < bound * std::hypot(values[k].stderr_of_mean(), error));
      // The jackknife of a sum of pairs errs on the high side where pairs of samples count: with few samples.
      const double ratio = claimed[k].mean / values[k].variance(), spread = std::sqrt(2.0 / (repeats - 1));
      INFO("claimed variance over true variance " << ratio);
      if (spp >= 4) CHECK(ratio > 1 - bound * spread);
      if (spp >= 32) CHECK(ratio < 1 + bound * spread);
    }
    // Paths that scatter often are dim and have large scores: the usual product is off by that covariance over the
    // samples.
    const double bias = naive[1].mean - exact.gradient[1];
    INFO(spp << " samples: the product of means is off by " << bias << " +- " << naive[1].stderr_of_mean() << " of "
             << exact.gradient[1]);
    if (spp <= 8) CHECK(std::abs(bias) > 5 * std::hypot(naive[1].stderr_of_mean(), exact.gradient_stderr[1]));
  }
}

TEST_CASE("an exposure scales the image, and the best one leaves no slope", "[stat]") {
  const Scene scene = small_sphere();
  RenderOptions options;
  options.derivatives = {"medium.sigma_t", "medium.albedo"};
  options.seed = 12;
  Renderer renderer(device(), scene, options);
  std::vector<Rendering> groups;
  for (int g = 0; g < 16; ++g) groups.push_back(renderer.render(16 * g, 16));
  TargetImage target = grey_target(0.5F);
  for (std::size_t i = 0; i < target.value.size(); ++i) target.value[i] += 0.02F * static_cast<float>(i % 5);

  // (s T - I)^2 = s^2 (T - I / s)^2
  TargetImage half = target;
  for (float& value : half.value) value /= 2;
  const LossGradient at_two = loss_gradient(groups, target, 2), of_half = loss_gradient(groups, half);
  CHECK(at_two.loss == Approx(4 * of_half.loss).epsilon(1e-6));
  for (std::size_t p = 0; p < 2; ++p) CHECK(at_two.gradient[p] == Approx(4 * of_half.gradient[p]).epsilon(1e-6));

  const double best = best_exposure(groups, target), step = 0.01;
  const double loss = loss_gradient(groups, target, best).loss;
  const double above = loss_gradient(groups, target, best + step).loss,
               below = loss_gradient(groups, target, best - step).loss;
  CHECK(above > loss);
  CHECK(below > loss);
  CHECK(above == Approx(below).epsilon(1e-6));  // a parabola about it

  TargetImage black = grey_target(0);
  CHECK_THROWS_AS(best_exposure(groups, black), ResultError);
}
