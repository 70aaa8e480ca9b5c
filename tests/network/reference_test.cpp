// The reference layers' gradients, in double, against finite differences: number by number.
#include <catch2/catch.hpp>

#include "layer_support.h"
#include "network/model/fully_connected.h"

namespace {

using namespace reference;

// Central differences of step 1e-6 of sums of some hundred terms of size 1: rounding some 1e-9, and no more error where
// the function is linear between kinks.
constexpr double tolerance = 1e-7;

template <class Function>
void check_gradient(Numbers& x, const Numbers& gradient, Function f) {
  REQUIRE(gradient.size() == x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    INFO("number " << i);
    CHECK(gradient[i] == Approx(difference(x, i, f)).margin(tolerance));
  }
}

}  // namespace

TEST_CASE("Reference: a convolution's gradients are its finite differences") {
  for (const std::size_t size : {1, 2, 5}) {
    const Shape s{2, 3, 2, size};
    Numbers input = random_numbers(s.input(), 1), weights = random_numbers(s.weights(), 2),
            bias = random_numbers(s.out, 3);
    const Numbers slope = random_numbers(s.output(), 4);
    const auto loss = [&] { return dot(slope, convolve(s, input, weights, bias)); };
    const Gradients gradients = convolve_backward(s, input, weights, slope);
    check_gradient(input, gradients.input, loss);
    check_gradient(weights, gradients.weights, loss);
    check_gradient(bias, gradients.bias, loss);
  }
}

TEST_CASE("Reference: a convolution is the sum over the neighbours, zero outside") {
  const Shape s{1, 1, 1, 3};
  const Numbers input{1, 2, 3, 4, 5, 6, 7, 8, 9}, weights{1, 10, 100, 0, 1000, 0, 0, 0, 0.5};
  const Numbers output = convolve(s, input, weights, {0.25});
  CHECK(output[4] == 0.25 + 1 * 1 + 2 * 10 + 3 * 100 + 5 * 1000 + 9 * 0.5);
  CHECK(output[0] == 0.25 + 1 * 1000 + 5 * 0.5);
  CHECK(output[8] == 0.25 + 5 * 1 + 6 * 10 + 9 * 1000);
}

TEST_CASE("Reference: ReLU's and max-pool's gradients are their finite differences") {
  for (const std::size_t size : {1, 2, 4, 5}) {
    const Shape s{2, 1, 2, size};
    Numbers map = random_numbers(s.output(), 5);
    const Numbers pooled_slope = random_numbers(s.pooled(), 6), slope = random_numbers(s.output(), 7);
    check_gradient(map, relu_backward(relu(map), slope), [&] { return dot(slope, relu(map)); });
    check_gradient(map, pool_backward(s, map, pooled_slope), [&] { return dot(pooled_slope, pool(s, map)); });
  }
}

TEST_CASE("Reference: a whole stage's gradients are its finite differences") {
  for (const std::size_t size : {1, 2, 4}) {
    const Shape s{2, 3, 2, size};
    Numbers input = random_numbers(s.input(), 8), weights = random_numbers(s.weights(), 9),
            bias = random_numbers(s.out, 10);
    const Numbers slope = random_numbers(s.pooled(), 11);
    const auto loss = [&] { return dot(slope, stage(s, input, weights, bias).output); };
    const Gradients gradients = stage_backward(s, input, weights, stage(s, input, weights, bias), slope);
    check_gradient(input, gradients.input, loss);
    check_gradient(weights, gradients.weights, loss);
    check_gradient(bias, gradients.bias, loss);
  }
}

TEST_CASE("The fully connected layer's gradients, in double, are its finite differences") {
  const itn::FullyConnectedShape s{3, 5, 2};
  Numbers input = random_numbers(15, 12), weight = random_numbers(10, 13), bias = random_numbers(2, 14);
  const Numbers slope = random_numbers(6, 15);
  const auto loss = [&] {
    Numbers output(6);
    itn::fully_connected(s, input.data(), weight.data(), bias.data(), output.data());
    return dot(slope, output);
  };
  Numbers input_gradient(15, 7), weight_gradient(10, 7), bias_gradient(2, 7);
  itn::fully_connected_backward(s, input.data(), weight.data(), slope.data(), input_gradient.data(),
                                weight_gradient.data(), bias_gradient.data());
  check_gradient(input, input_gradient, loss);
  check_gradient(weight, weight_gradient, loss);
  check_gradient(bias, bias_gradient, loss);
}
