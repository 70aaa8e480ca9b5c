// Adam against PyTorch, and the learning-rate schedule.
#include "network/training/adam.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

namespace {

using namespace itn;

std::vector<Tensor> tensor(std::vector<float> values) {
  const std::size_t count = values.size();
  return {{"w", {count}, std::move(values)}};
}

std::vector<Tensor> gradient_at(int step) {
  return tensor({0.3f * static_cast<float>(step + 1), -1e-3f, step % 2 == 0 ? 5.0f : -5.0f, 0.0f});
}

}  // namespace

TEST_CASE("Five steps of Adam are PyTorch's") {
  // w = tensor([1., -2., .5, 0.]); torch.optim.Adam([w], lr=0.01), PyTorch 2.15; w.grad as in gradient_at; w.tolist()
  const std::vector<double> expected{0.951491654, -1.95000064, 0.485650539, 0};
  std::vector<Tensor> weights = tensor({1.0f, -2.0f, 0.5f, 0.0f});
  Adam adam(weights);
  for (int step = 0; step < 5; ++step) adam.step(weights, gradient_at(step), 0.01);
  for (std::size_t i = 0; i < 4; ++i) CHECK(weights[0].values[i] == Approx(expected[i]).margin(2e-7));
}

TEST_CASE("Adam's first step is the learning rate, whatever the gradient's size; none without a gradient") {
  std::vector<Tensor> weights = tensor({1.0f, 1.0f, 1.0f});
  Adam adam(weights);
  adam.step(weights, tensor({1e-4f, -1e4f, 0.0f}), 0.125);
  CHECK(weights[0].values[0] == Approx(0.875).margin(2e-5));  // epsilon is 1e-4 of this gradient
  CHECK(weights[0].values[1] == Approx(1.125));
  CHECK(weights[0].values[2] == 1);
}

TEST_CASE("Adam goes on from its state to the same bits") {
  std::vector<Tensor> weights = tensor({1.0f, -2.0f, 0.5f, 0.0f});
  Adam adam(weights);
  for (int step = 0; step < 3; ++step) adam.step(weights, gradient_at(step), 0.01);
  std::vector<Tensor> continued = weights;
  Adam resumed(continued);
  resumed.state() = adam.state();
  for (int step = 3; step < 6; ++step) {
    adam.step(weights, gradient_at(step), 0.01);
    resumed.step(continued, gradient_at(step), 0.01);
  }
  CHECK(continued[0].values == weights[0].values);
}

TEST_CASE("Weight decay takes a share off weights beside Adam's own step, and nothing off biases") {
  std::vector<Tensor> weights{{"weight", {1, 2}, {2.0F, -3.0F}}, {"bias", {2}, {2.0F, -3.0F}}}, plain = weights;
  const std::vector<Tensor> gradients{{"weight", {1, 2}, {0.5F, 0.25F}}, {"bias", {2}, {0.5F, 0.25F}}};
  Adam decaying(weights, {.weight_decay = 5}), adam(plain);
  decaying.step(weights, gradients, 1e-2);
  adam.step(plain, gradients, 1e-2);
  CHECK(weights[0].values[0] == Approx(plain[0].values[0] - 1e-2 * 5 * 2));
  CHECK(weights[0].values[1] == Approx(plain[0].values[1] + 1e-2 * 5 * 3));
  CHECK(weights[1].values == plain[1].values);
}

TEST_CASE("The learning rate rises in the first tenth of the steps and falls along half a cosine wave") {
  CHECK(scheduled_learning_rate(1e-3, 1e-5, 0, 100) == Approx(1e-3 / 10));
  CHECK(scheduled_learning_rate(1e-3, 1e-5, 2, 100) == Approx(1e-3 * 3 / 10).epsilon(1e-2));
  CHECK(scheduled_learning_rate(1, 0, 10, 100) == Approx((1 + std::cos(0.1 * std::numbers::pi)) / 2));
  CHECK(scheduled_learning_rate(1e-3, 1e-5, 50, 100) == Approx((1e-3 + 1e-5) / 2));
  CHECK(scheduled_learning_rate(1, 0, 25, 100) == Approx((1 + std::sqrt(0.5)) / 2));
  CHECK(scheduled_learning_rate(1e-3, 1e-5, 100, 100) == 1e-5);
  CHECK(scheduled_learning_rate(1e-3, 1e-5, 1000, 100) == 1e-5);
  CHECK(scheduled_learning_rate(1e-3, 1e-5, 0, 0) == 1e-5);
}
