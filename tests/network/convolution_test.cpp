// oneDNN's float stages against the reference in double, at every kind of shape that the network has: few input
// channels, whole blocks, direct and Winograd's algorithm, images of one, two and more pixels.
#include "network/model/convolution.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "layer_support.h"

namespace {

using namespace reference;
using dnnl::memory;

memory::desc plain(std::size_t batch, std::size_t channels, std::size_t size) {
  const auto side = static_cast<memory::dim>(size);
  return {{static_cast<memory::dim>(batch), static_cast<memory::dim>(channels), side, side},
          memory::data_type::f32,
          memory::format_tag::nchw};
}

// Copies between row-major numbers and oneDNN's memory of the same shape in any layout.
void store(dnnl::stream& stream, const Numbers& numbers, const memory::desc& description, memory to) {
  std::vector<float> floats = as_floats(numbers);
  memory from(description, to.get_engine(), floats.data());
  dnnl::reorder(from, to).execute(stream, from, to);
  stream.wait();
}
Numbers load(dnnl::stream& stream, memory from, const memory::desc& description) {
  std::vector<float> floats(description.get_size() / sizeof(float));
  memory to(description, from.get_engine(), floats.data());
  dnnl::reorder(from, to).execute(stream, from, to);
  stream.wait();
  return {floats.begin(), floats.end()};
}

// Root mean square of the differences, as a multiple of the reference's.
template <class Values>
double relative_error(const Values& values, const Numbers& expected) {
  REQUIRE(values.size() == expected.size());
  double error = 0, square = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    error += std::pow(static_cast<double>(values[i]) - expected[i], 2);
    square += expected[i] * expected[i];
  }
  return std::sqrt(error / square);
}

// first: nobody asks for the gradient by the images
void check_stage(const Shape& s, bool first = false) {
  INFO(s.in << " to " << s.out << " channels, " << s.size << " pixels, batch " << s.batch);
  const Numbers input = rounded(random_numbers(s.input(), 1)), bias = rounded(random_numbers(s.out, 2, 0.1)),
                weights = rounded(random_numbers(s.weights(), 3, std::sqrt(2.0 / static_cast<double>(9 * s.in)))),
                slope = rounded(random_numbers(s.pooled(), 4));
  const Stage expected = stage(s, input, weights, bias);
  const Gradients gradients = stage_backward(s, input, weights, expected, slope);

  const dnnl::engine engine(dnnl::engine::kind::cpu, 0);
  dnnl::stream stream(engine);
  // The first stage reads plain images; later ones blocks of channels.
  memory::desc layout = plain(s.batch, s.in, s.size);
  if (s.in % 16 == 0) layout = memory::desc(layout.dims(), memory::data_type::f32, memory::format_tag::nChw16c);
  memory images(layout, engine), images_gradient;
  if (!first) images_gradient = memory(layout, engine);
  store(stream, input, plain(s.batch, s.in, s.size), images);
  itn::ConvolutionStage fast(
      engine, {static_cast<int>(s.batch), static_cast<int>(s.in), static_cast<int>(s.out), static_cast<int>(s.size)},
      images, images_gradient);
  const std::vector<float> float_weights = as_floats(weights), float_bias = as_floats(bias);
  std::vector<float> weights_gradient(s.weights(), 7), bias_gradient(s.out, 7);
  fast.forward(stream, float_weights.data(), float_bias.data());
  const memory::desc output = plain(s.batch, s.out, s.pooled_size());
  const Numbers value = load(stream, fast.output(), output);
  store(stream, slope, output, fast.output_gradient());
  fast.backward(stream, float_weights.data(), weights_gradient.data(), bias_gradient.data());

  // Single precision rounds by 6e-8; the transforms of Winograd's 4x4 tiles make ten to twenty times that of it.
  constexpr double tolerance = 3e-6;
  CHECK(relative_error(value, expected.output) < tolerance);
  CHECK(relative_error(weights_gradient, gradients.weights) < tolerance);
  CHECK(relative_error(bias_gradient, gradients.bias) < tolerance);
  if (!first)
    CHECK(relative_error(load(stream, images_gradient, plain(s.batch, s.in, s.size)), gradients.input) < tolerance);
}

}  // namespace

TEST_CASE("Convolution stages in float are the reference in double, forward and backward") {
  for (const std::size_t in : {1, 2, 3, 4, 6, 7, 11})
    for (const bool first : {true, false}) check_stage({3, in, 16, 8}, first);
  check_stage({2, 6, 16, 16}, true);
  check_stage({3, 16, 32, 16});
  check_stage({2, 32, 64, 8});
  check_stage({3, 64, 128, 4});
  check_stage({5, 128, 256, 2});
  check_stage({3, 128, 256, 1});
  check_stage({2, 512, 1024, 2});
}
