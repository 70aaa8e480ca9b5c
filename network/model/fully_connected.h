// The last layer: output = weight * input + bias. Of 1,024 inputs and three outputs: plain loops are fast enough.
#pragma once
#include <cstddef>

namespace itn {

struct FullyConnectedShape {
  std::size_t batch, inputs, outputs;
};

// input (batch, inputs), weight (outputs, inputs), bias (outputs), output (batch, outputs): row-major.
template <class Real>
void fully_connected(const FullyConnectedShape& shape, const Real* input, const Real* weight, const Real* bias,
                     Real* output) {
  for (std::size_t n = 0; n < shape.batch; ++n)
    for (std::size_t o = 0; o < shape.outputs; ++o) {
      Real sum = bias[o];
      for (std::size_t i = 0; i < shape.inputs; ++i) sum += weight[o * shape.inputs + i] * input[n * shape.inputs + i];
      output[n * shape.outputs + o] = sum;
    }
}

// The gradients by input, weight and bias, from the one by output; each laid out as what it belongs to.
template <class Real>
void fully_connected_backward(const FullyConnectedShape& shape, const Real* input, const Real* weight,
                              const Real* output_gradient, Real* input_gradient, Real* weight_gradient,
                              Real* bias_gradient) {
  for (std::size_t i = 0; i < shape.batch * shape.inputs; ++i) input_gradient[i] = 0;
  for (std::size_t i = 0; i < shape.outputs * shape.inputs; ++i) weight_gradient[i] = 0;
  for (std::size_t o = 0; o < shape.outputs; ++o) bias_gradient[o] = 0;
  for (std::size_t n = 0; n < shape.batch; ++n)
    for (std::size_t o = 0; o < shape.outputs; ++o) {
      const Real slope = output_gradient[n * shape.outputs + o];
      bias_gradient[o] += slope;
      for (std::size_t i = 0; i < shape.inputs; ++i) {
        weight_gradient[o * shape.inputs + i] += slope * input[n * shape.inputs + i];
        input_gradient[n * shape.inputs + i] += slope * weight[o * shape.inputs + i];
      }
    }
}

}  // namespace itn
