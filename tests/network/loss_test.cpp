// Ranges of the outputs, losses and their gradients.
#include "itn/loss.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "itn/error.h"
#include "layer_support.h"

namespace {

using namespace itn;
using reference::Numbers;

}  // namespace

TEST_CASE("Every output is a parameter strictly inside its range, rising, in the middle at 0") {
  for (const OutputRange& range : default_outputs()) {
    INFO(range.name);
    double before = range.low;
    for (double output = -20; output <= 20; output += 0.5) {
      const double parameter = range.parameter(output);
      CHECK(parameter > before);
      CHECK(parameter < range.high);
      before = parameter;
    }
    // So far out that the logistic function rounds to 0 or 1, not beyond the range.
    CHECK(range.parameter(-1e4) == Approx(range.low));
    CHECK(range.parameter(1e4) == Approx(range.high));
  }
  const std::vector<OutputRange> outputs = default_outputs();
  CHECK(outputs[0].parameter(0) == Approx(std::sqrt(20.0 * 300)));
  CHECK(outputs[1].parameter(0) == Approx((0.35 + 0.97) / 2));
}

TEST_CASE("Share and parameter are each other's inverse, their derivatives are finite differences") {
  for (const OutputRange& range : default_outputs()) {
    INFO(range.name);
    for (const double output : {-6.0, -1.3, 0.0, 0.4, 5.0}) {
      CHECK(range.share(range.parameter(output)) == Approx(share_of_output(output)).epsilon(1e-12));
      Numbers x{output};
      const double slope = difference(x, 0, [&] { return range.parameter(x[0]); });
      CHECK(range.parameter_derivative(output) == Approx(slope).epsilon(1e-6));
      CHECK(share_derivative(output) == Approx(difference(x, 0, [&] { return share_of_output(x[0]); })).epsilon(1e-6));
    }
    CHECK(range.share(range.low) == 0);
    CHECK(range.share(range.high) == Approx(1));
  }
}

TEST_CASE("Ranges that cannot be are usage errors") {
  CHECK_NOTHROW(check_outputs(default_outputs()));
  CHECK_THROWS_AS(check_outputs({}), UsageError);
  CHECK_THROWS_AS(check_outputs({{"g", 0.5, 0.5, false}}), UsageError);
  CHECK_THROWS_AS(check_outputs({{"g", 0, NAN, false}}), UsageError);
  CHECK_THROWS_AS(check_outputs({{"sigma_t", 0, 1, true}}), UsageError);
  CHECK_THROWS_AS(check_outputs({{"", 0, 1, false}}), UsageError);
  CHECK_THROWS_AS(check_outputs({{"g", 0, 1, false}, {"g", 0, 2, false}}), UsageError);
}

TEST_CASE("The supervised loss is the mean squared difference of shares, and its gradient the finite difference") {
  const std::vector<OutputRange> ranges = default_outputs();
  const std::vector<double> truth{40, 0.8, 0.5, 250, 0.4, 0.0};
  Numbers outputs{0.3, -1.1, 2.0, 0.0, -0.4, 1.5};
  const auto loss = [&] {
    double sum = 0;
    for (std::size_t i = 0; i < 6; ++i)
      sum += std::pow(1 / (1 + std::exp(-outputs[i])) - ranges[i % 3].share(truth[i]), 2);
    return sum / 6;
  };
  outputs = rounded(outputs);
  const OutputLoss result = supervised_loss(as_floats(outputs), truth, ranges);
  CHECK(result.loss == Approx(loss()).epsilon(1e-12));
  for (std::size_t i = 0; i < 6; ++i) CHECK(result.gradient[i] == Approx(difference(outputs, i, loss)).epsilon(1e-6));
}

TEST_CASE("An image loss is added with its weight, its gradient through the ranges") {
  const std::vector<OutputRange> ranges = default_outputs();
  const std::vector<double> truth{40, 0.8, 0.5};
  const std::vector<float> outputs{0.25f, -1.0f, 2.0f};
  const OutputLoss supervised = supervised_loss(outputs, truth, ranges);
  const std::vector<double> parameters = parameters_of(outputs, NetworkDescription());
  // A made-up image loss: the sum of squared logarithms.
  ImageLoss::Result image;
  for (const double p : parameters) {
    image.loss += std::pow(std::log(p), 2);
    image.gradient.push_back(2 * std::log(p) / p);
  }
  OutputLoss both = supervised;
  constexpr double weight = 1e-3;
  add_image_loss(both, image, weight, outputs, ranges);
  CHECK(both.loss == Approx(supervised.loss + weight * image.loss));
  Numbers x{outputs.begin(), outputs.end()};
  for (std::size_t i = 0; i < 3; ++i) {
    const double slope = difference(x, i, [&] { return std::pow(std::log(ranges[i].parameter(x[i])), 2); });
    CHECK(both.gradient[i] - supervised.gradient[i] == Approx(weight * slope).epsilon(1e-3));
  }
}

TEST_CASE("An image's gradient is never longer than the supervised one can be, and keeps its direction") {
  const std::vector<OutputRange> ranges = default_outputs();
  const std::vector<float> outputs{0.5F, -1, 0.2F, 1, 0, -0.5F};
  // The longest of all: shares of 2/3 that should be 0.
  const auto z = static_cast<float>(std::log(2.0));
  const std::vector<double> low{ranges[0].low, ranges[1].low, ranges[2].low,
                                ranges[0].low, ranges[1].low, ranges[2].low};
  const OutputLoss worst = supervised_loss(std::vector<float>(6, z), low, ranges);
  const auto length = [](const std::vector<float>& g, std::size_t first) {
    return std::hypot(g[first], g[first + 1], g[first + 2]);
  };
  ImageLoss::Result image{1, {1, 2, 3, 1e-7, 1e-6, 1e-6}};
  OutputLoss small{0, std::vector<float>(6)}, large = small;
  add_image_loss(small, image, 1e-6, outputs, ranges);
  add_image_loss(large, image, 1e3, outputs, ranges);
  CHECK(length(large.gradient, 0) == Approx(length(worst.gradient, 0)).epsilon(1e-5));
  CHECK(length(large.gradient, 3) < 0.99 * length(worst.gradient, 3));
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(large.gradient[i] / length(large.gradient, 0) ==
          Approx(small.gradient[i] / length(small.gradient, 0)).epsilon(1e-4));
    CHECK(large.gradient[3 + i] == Approx(1e9 * small.gradient[3 + i]).epsilon(1e-4));
  }
}
