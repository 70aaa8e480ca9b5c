// One stage of the network: 3x3 convolution with zero padding, ReLU, 2x2 max-pool; forward and backward, by oneDNN.
// README.md, "Convolutions", says why oneDNN, and which of its algorithms where.
#pragma once
#include <oneapi/dnnl/dnnl.hpp>

namespace itn {

struct ConvolutionShape {
  int batch = 1, in_channels = 1, out_channels = 1;
  int size = 1;  // side of the square images [pixels]
};

class ConvolutionStage {
 public:
  // input: where the stage reads its images (batch, in_channels, size, size), in any layout; input_gradient: where it
  // leaves the gradient by them, in the same layout, or empty where nobody asks for that.
  ConvolutionStage(const dnnl::engine& engine, const ConvolutionShape& shape, const dnnl::memory& input,
                   const dnnl::memory& input_gradient);

  // From the input: output(). weights (out, in, 3, 3) and bias (out), row-major.
  void forward(dnnl::stream& stream, const float* weights, const float* bias);

  // After forward() with the same weights, from output_gradient(), which it overwrites: the gradients by input, weights
  // and bias, laid out as those are.
  void backward(dnnl::stream& stream, const float* weights, float* weights_gradient, float* bias_gradient);

  // (batch, out, size / 2, size / 2), halves rounded down; an image of one pixel stays one.
  const dnnl::memory& output() const { return output_; }
  const dnnl::memory& output_gradient() const { return output_gradient_; }  // laid out as output()

 private:
  void create_forward();
  void create_pooling();
  void create_backward_weights();
  dnnl::convolution_backward_weights::primitive_desc describe_backward_weights() const;
  void create_backward_input();
  void weights_gradient_by_convolution(dnnl::stream& stream, float* weights_gradient, float* bias_gradient);
  void weights_gradient_by_product(dnnl::stream& stream, float* weights_gradient, float* bias_gradient);

  dnnl::engine engine_;
  ConvolutionShape shape_;
  dnnl::memory input_, map_, output_;  // map_: before pooling
  dnnl::memory input_gradient_, map_gradient_, output_gradient_;
  dnnl::memory pooled_from_;  // which of four pixels each maximum was
  dnnl::memory weights_, weights_for_input_gradient_, weights_gradient_;
  // Inputs of the gradient by weights: so many input channels at a time, with zeros beside fewer, in the layout that it
  // needs.
  int group_;
  dnnl::memory input_for_weights_, map_gradient_for_weights_;
  dnnl::convolution_forward::primitive_desc forward_description_;
  dnnl::convolution_forward forward_;
  dnnl::convolution_backward_weights backward_weights_;
  dnnl::convolution_backward_data backward_input_;
  dnnl::pooling_forward pool_;
  dnnl::pooling_backward unpool_;
};

}  // namespace itn
