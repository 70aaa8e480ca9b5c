// The whole network: its structure, its gradient, its first weights, and that the same input gives the same bits.
#include "itn/network.h"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "itn/error.h"
#include "itn/loss.h"
#include "layer_support.h"
#include "network/model/fully_connected.h"
#include "network/training/adam.h"

namespace {

using namespace itn;
using reference::Numbers;

Numbers as_numbers(const std::vector<float>& values) { return {values.begin(), values.end()}; }

// The network by the reference layers: raw outputs, and for a gradient by them the one by every weight.
struct Reference {
  Numbers outputs;
  std::vector<Numbers> gradients;
};

Reference reference_network(const Network& network, const Numbers& images, std::size_t batch, const Numbers& slope) {
  std::vector<Numbers> weights;
  for (const Tensor& weight : network.weights()) weights.push_back(as_numbers(weight.values));
  std::vector<reference::Shape> shapes;
  std::vector<reference::Stage> stages;
  std::vector<Numbers> inputs{images};
  const NetworkDescription& description = network.description();
  reference::Shape shape{batch, static_cast<std::size_t>(description.channels),
                         static_cast<std::size_t>(description.width), static_cast<std::size_t>(description.size)};
  for (std::size_t i = 0; i < NETWORK_STAGES; ++i) {
    shapes.push_back(shape);
    stages.push_back(reference::stage(shape, inputs.back(), weights[2 * i], weights[2 * i + 1]));
    inputs.push_back(stages.back().output);
    shape = {batch, shape.out, 2 * shape.out, shape.pooled_size()};
  }
  const FullyConnectedShape last{batch, shape.in, description.outputs.size()};
  Reference result{Numbers(batch * last.outputs), std::vector<Numbers>(weights.size())};
  fully_connected(last, inputs.back().data(), weights[14].data(), weights[15].data(), result.outputs.data());

  result.gradients[14].resize(weights[14].size());
  result.gradients[15].resize(weights[15].size());
  Numbers gradient(inputs.back().size());
  fully_connected_backward(last, inputs.back().data(), weights[14].data(), slope.data(), gradient.data(),
                           result.gradients[14].data(), result.gradients[15].data());
  for (std::size_t i = NETWORK_STAGES; i-- > 0;) {
    reference::Gradients all = reference::stage_backward(shapes[i], inputs[i], weights[2 * i], stages[i], gradient);
    result.gradients[2 * i] = all.weights;
    result.gradients[2 * i + 1] = all.bias;
    gradient = all.input;
  }
  return result;
}

Network network_of(int channels, int size, std::uint64_t seed = 1, int width = 16) {
  Network network({"rn", channels, size, default_outputs(), width});
  network.initialise(seed);
  return network;
}

std::vector<float> random_images(const Network& network, int batch) {
  return as_floats(random_numbers(static_cast<std::size_t>(batch) * network.image_values(), 5));
}

}  // namespace

TEST_CASE("The network's outputs and gradients are the reference's, with one and with six channels, at any width") {
  for (const auto& [channels, size, width] :
       {std::array{1, 16, 16}, {6, 16, 16}, {6, 16, 24}, {6, 32, 2}, {1, 16, 5}, {1, 128, 1}}) {
    INFO(channels << " channels, " << size << " pixels, width " << width);
    Network network = network_of(channels, size, 1, width);
    for (std::size_t i = 1; i < network.weights().size(); i += 2)  // biases other than 0
      network.weights()[i].values = as_floats(random_numbers(network.weights()[i].values.size(), 40 + i, 0.1));
    const std::vector<float> images = random_images(network, 2);
    const Numbers slope = rounded(random_numbers(6, 6));
    const Reference expected = reference_network(network, as_numbers(images), 2, slope);

    const std::vector<float> outputs = network.forward(images, 2);
    network.backward(as_floats(slope));
    for (std::size_t i = 0; i < outputs.size(); ++i) CHECK(outputs[i] == Approx(expected.outputs[i]).epsilon(1e-5));
    REQUIRE(network.gradients().size() == 16);
    for (std::size_t i = 0; i < 16; ++i) {
      const Numbers wanted = expected.gradients[i], found = as_numbers(network.gradients()[i].values);
      REQUIRE(found.size() == wanted.size());
      double error = 0;
      for (std::size_t k = 0; k < found.size(); ++k) error += std::pow(found[k] - wanted[k], 2);
      INFO(network.weights()[i].name);
      CHECK(std::sqrt(error / dot(wanted, wanted)) < 1e-5);
    }
  }
}

TEST_CASE("The network has the paper's 6.3 million weights, whatever the size of the images") {
  for (const int size : {64, 128}) {
    const Network network({"rn", 6, size, default_outputs()});
    std::size_t count = 0;
    for (const Tensor& weight : network.weights()) {
      CHECK(weight.values.size() == count_of(weight.shape));
      count += weight.values.size();
    }
    CHECK(count == 9 * (6 * 16 + 16 * 32 + 32 * 64 + 64 * 128 + 128 * 256 + 256 * 512 + 512 * 1024) + 2032 + 3 * 1025);
  }
}

TEST_CASE("First weights have the variance of He et al., and are a function of the seed") {
  const Network network = network_of(6, 64, 7);
  for (std::size_t i = 0; i < network.weights().size(); i += 2) {
    const Tensor& weight = network.weights()[i];
    const auto inputs = static_cast<double>(weight.values.size() / weight.shape[0]);
    double square = 0;
    for (const float value : weight.values) square += static_cast<double>(value) * value;
    const auto count = static_cast<double>(weight.values.size());
    // The mean of squared normal numbers has the relative standard deviation sqrt(2 / count).
    CHECK(square / count * inputs / 2 == Approx(1).margin(4 * std::sqrt(2 / count)));
    for (const float bias : network.weights()[i + 1].values) CHECK(bias == 0);
  }
  // Layers do not resemble each other: of equal numbers the ratios would all be the same.
  const std::vector<float>&a = network.weights()[2].values, &b = network.weights()[4].values;
  CHECK(std::abs(a[0] / b[0] - a[1] / b[1]) > 1e-3);
  CHECK(network_of(6, 64, 7).weights()[2].values == network.weights()[2].values);
  CHECK(network_of(6, 64, 8).weights()[2].values != network.weights()[2].values);
}

TEST_CASE("The same training steps give the same bits, also after batches of another size") {
  const auto train = [](bool other_batches) {
    Network network = network_of(6, 16);
    Adam adam(network.weights());
    const std::vector<float> images = random_images(network, 5);
    std::vector<double> truth;
    for (int i = 0; i < 5; ++i) truth.insert(truth.end(), {30.0 + 50 * i, 0.5, 0.1 * i});
    for (int step = 0; step < 2; ++step) {
      if (other_batches) network.forward(random_images(network, 2), 2);
      const OutputLoss loss = supervised_loss(network.forward(images, 5), truth, network.description().outputs);
      network.backward(loss.gradient);
      adam.step(network.weights(), network.gradients(), 1e-3);
    }
    return network;
  };
  const Network first = train(false), second = train(true);
  for (std::size_t i = 0; i < first.weights().size(); ++i)
    CHECK(first.weights()[i].values == second.weights()[i].values);
}

TEST_CASE("An image's outputs do not depend on the others of its batch") {
  Network network = network_of(1, 32);
  const std::vector<float> images = random_images(network, 3);
  const std::vector<float> together = network.forward(images, 3);
  const std::vector<float> last(images.end() - static_cast<std::ptrdiff_t>(network.image_values()), images.end());
  const std::vector<float> alone = network.forward(last, 1);
  for (std::size_t i = 0; i < 3; ++i) CHECK(alone[i] == Approx(together[6 + i]).epsilon(1e-5));
}

TEST_CASE("Networks and batches that cannot be are usage errors") {
  const auto make = [](NetworkDescription description) { Network network(std::move(description)); };
  CHECK_NOTHROW(make({"ssn", 1, 128, default_outputs()}));
  CHECK_THROWS_AS(make({"gan", 1, 128, default_outputs()}), UsageError);
  CHECK_THROWS_AS(make({"rn", 3, 128, default_outputs()}), UsageError);
  CHECK_THROWS_AS(make({"rn", 1, 96, default_outputs()}), UsageError);
  CHECK_THROWS_AS(make({"rn", 1, 256, default_outputs()}), UsageError);
  CHECK_THROWS_AS(make({"rn", 1, 0, default_outputs()}), UsageError);
  CHECK_THROWS_AS(make({"rn", 1, 64, {}}), UsageError);
  CHECK_THROWS_AS(make({"rn", 1, 64, default_outputs(), 65}), UsageError);
  Network network({"rn", 1, 4, default_outputs()});
  CHECK_THROWS_AS(network.backward(std::vector<float>(3)), UsageError);
  CHECK_THROWS_AS(network.forward(std::vector<float>(17), 1), UsageError);
  CHECK_THROWS_AS(network.forward({}, 0), UsageError);
  network.forward(std::vector<float>(16), 1);
  CHECK_THROWS_AS(network.backward(std::vector<float>(6)), UsageError);
}
