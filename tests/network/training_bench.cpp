// Training images/s: build/bin/test_network '[bench]', or beside PyTorch: tests/network/training_pytorch.py.
#include <sys/resource.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "itn/loss.h"
#include "itn/network.h"
#include "network/training/adam.h"
#include "runtime/base/random.h"

namespace {

using namespace itn;

double user_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) + 1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Prints "SIZE seconds a step, user seconds a step", the best of several steps: forward, loss, backward, Adam.
void measure(int size) {
  constexpr int batch = 32;
  Network network({"rn", 6, size, default_outputs()});
  network.initialise(1);
  Adam adam(network.weights());
  std::vector<float> images(batch * network.image_values());
  for (std::size_t i = 0; i < images.size(); ++i) images[i] = static_cast<float>(random_uniform(1, 2, i));
  std::vector<double> truth;
  for (int i = 0; i < batch; ++i) truth.insert(truth.end(), {100 + i * 0.5, 0.8, 0.4});

  double best_wall = 1e9, best_user = 1e9, loss = 0;
  for (int step = 0; step < 12; ++step) {
    const double wall = wall_seconds(), user = user_seconds();
    const OutputLoss result = supervised_loss(network.forward(images, batch), truth, network.description().outputs);
    network.backward(result.gradient);
    adam.step(network.weights(), network.gradients(), 1e-4);
    loss = result.loss;
    if (step == 0) continue;  // what is created at first use
    best_wall = std::min(best_wall, wall_seconds() - wall);
    best_user = std::min(best_user, user_seconds() - user);
  }
  std::printf("%d %.4f %.4f\n", size, best_wall, best_user);
  CHECK(std::isfinite(loss));
}

}  // namespace

TEST_CASE("Training steps of 32 images of 128x128x6", "[.bench]") { measure(128); }
TEST_CASE("Training steps of 32 images of 64x64x6", "[.bench]") { measure(64); }
