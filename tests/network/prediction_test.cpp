#include "network/training/prediction.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "itn/loss.h"
#include "runtime/base/random.h"

namespace {

using namespace itn;

class Noise : public Examples {
 public:
  std::size_t count() const override { return 37; }
  void read(std::size_t index, std::uint64_t, std::span<float> image, std::span<double> truth) const override {
    for (std::size_t i = 0; i < image.size(); ++i) image[i] = static_cast<float>(random_normal(1, index, i));
    for (std::size_t i = 0; i < truth.size(); ++i) truth[i] = static_cast<double>(index + i);
  }
};

}  // namespace

TEST_CASE("Predictions are the network's parameters for every example, in whichever batches") {
  Network network({"rn", 1, 4, {{"sigma_t", 20, 300, true}, {"albedo", 0.3, 1, false}}, 2});
  network.initialise(1);
  const Predictions predictions = predict(network, Noise());
  REQUIRE(predictions.predicted.size() == 74);
  for (std::size_t i = 0; i < 37; ++i) {
    std::vector<float> image(16);
    std::vector<double> truth(2);
    Noise().read(i, 0, image, truth);
    const std::vector<double> alone = parameters_of(network.forward(image, 1), network.description());
    for (std::size_t output = 0; output < 2; ++output) {
      CHECK(predictions.predicted[2 * i + output] == Approx(alone[output]).epsilon(1e-5));
      CHECK(predictions.truth[2 * i + output] == truth[output]);
    }
  }
}

TEST_CASE("Root mean square errors are of each output alone") {
  const Predictions predictions{2, {1, 10, 2, 20, 3, 30}, {1, 10, 4, 20, 3, 36}};
  const std::vector<double> errors = root_mean_square_errors(predictions);
  REQUIRE(errors.size() == 2);
  CHECK(errors[0] == Approx(std::sqrt(4.0 / 3)));
  CHECK(errors[1] == Approx(std::sqrt(36.0 / 3)));
}
