#include "network/model/convolution.h"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <vector>

namespace itn {
namespace {

using dnnl::algorithm;
using dnnl::memory;
using Tag = memory::format_tag;

memory::desc floats(const memory::dims& dims, Tag layout = Tag::any) { return {dims, memory::data_type::f32, layout}; }

memory::desc weights_of(const ConvolutionShape& shape, Tag layout = Tag::any) {
  return floats({shape.out_channels, shape.in_channels, 3, 3}, layout);
}

memory::desc map_of(const ConvolutionShape& shape) {
  return floats({shape.batch, shape.out_channels, shape.size, shape.size});
}

// A row-major array of the caller's as oneDNN's memory; oneDNN knows no constant memory.
memory as_memory(const memory::desc& description, const dnnl::engine& engine, const float* data) {
  return {description, engine, const_cast<float*>(data)};
}

void reorder(dnnl::stream& stream, memory from, memory to) { dnnl::reorder(from, to).execute(stream, from, to); }

// oneDNN's vector code takes whole blocks of channels.
bool whole_blocks(const ConvolutionShape& shape) { return shape.in_channels % 16 == 0; }

// Winograd's algorithm (Lavin and Gray 2016) computes tiles of 4x4 pixels.
bool prefers_winograd(const ConvolutionShape& shape) { return whole_blocks(shape) && shape.size >= 4; }

// With fewer pixels the weights are most of what there is to read and write, and oneDNN's convolutions go through all
// their gradients once an image; on some processors they have no vector code at all for so few pixels.
bool prefers_product(const ConvolutionShape& shape) { return whole_blocks(shape) && shape.size <= 2; }

// describe: from an algorithm to a primitive description, which is empty where oneDNN has none for this processor.
template <class Describe>
auto winograd_or_direct(bool winograd, const Describe& describe) {
  if (winograd)
    if (auto description = describe(algorithm::convolution_winograd)) return description;
  return describe(algorithm::convolution_direct);
}

float* values(const memory& memory) { return static_cast<float*>(memory.get_data_handle()); }

// images: (batch, size, size, in). Returns for every pixel (batch, size, size) its 3x3 neighbours' channels (9, in),
// zero outside of the image.
std::vector<float> neighbours_of_pixels(const ConvolutionShape& shape, const float* images) {
  const int size = shape.size, in = shape.in_channels;
  std::vector<float> neighbours;
  neighbours.reserve(static_cast<std::size_t>(shape.batch * size * size * 9) * static_cast<std::size_t>(in));
  for (int image = 0; image < shape.batch; ++image)
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x)
        for (int ny = y - 1; ny <= y + 1; ++ny)
          for (int nx = x - 1; nx <= x + 1; ++nx) {
            if (ny < 0 || ny >= size || nx < 0 || nx >= size) {
              neighbours.insert(neighbours.end(), static_cast<std::size_t>(in), 0.0f);
            } else {
              const float* const from = images + static_cast<std::ptrdiff_t>((image * size + ny) * size + nx) * in;
              neighbours.insert(neighbours.end(), from, from + in);
            }
          }
  return neighbours;
}

const memory::dims one{1, 1}, two{2, 2}, none{0, 0};

dnnl::convolution_forward::primitive_desc describe_forward(const dnnl::engine& engine, const ConvolutionShape& shape,
                                                           const memory::desc& input, bool winograd) {
  dnnl::post_ops relu;
  relu.append_eltwise(1, algorithm::eltwise_relu, 0, 0);
  dnnl::primitive_attr attributes;
  attributes.set_post_ops(relu);
  return winograd_or_direct(winograd, [&](algorithm chosen) {
    return dnnl::convolution_forward::primitive_desc(
        {dnnl::prop_kind::forward_training, chosen, input, weights_of(shape), floats({shape.out_channels}, Tag::x),
         map_of(shape), one, one, one},
        attributes, engine, true);
  });
}

}  // namespace

ConvolutionStage::ConvolutionStage(const dnnl::engine& engine, const ConvolutionShape& shape, const memory& input,
                                   const memory& input_gradient)
    : engine_(engine), shape_(shape), input_(input), input_gradient_(input_gradient) {
  create_forward();
  create_pooling();
  create_backward_weights();
  if (input_gradient_) create_backward_input();
}

void ConvolutionStage::create_forward() {
  forward_description_ = describe_forward(engine_, shape_, input_.get_desc(), prefers_winograd(shape_));
  forward_ = dnnl::convolution_forward(forward_description_);
  weights_ = memory(forward_description_.weights_desc(), engine_);
  map_ = memory(forward_description_.dst_desc(), engine_);
  map_gradient_ = memory(map_.get_desc(), engine_);
}

void ConvolutionStage::create_pooling() {
  if (shape_.size == 1) {
    output_ = map_;
    output_gradient_ = map_gradient_;
    return;
  }
  const memory::desc pooled = floats({shape_.batch, shape_.out_channels, shape_.size / 2, shape_.size / 2});
  const dnnl::pooling_forward::primitive_desc forward(
      {dnnl::prop_kind::forward_training, algorithm::pooling_max, map_.get_desc(), pooled, two, two, none, none},
      engine_);
  output_ = memory(forward.dst_desc(), engine_);
  output_gradient_ = memory(forward.dst_desc(), engine_);
  pooled_from_ = memory(forward.workspace_desc(), engine_);
  pool_ = dnnl::pooling_forward(forward);
  unpool_ = dnnl::pooling_backward(
      {{algorithm::pooling_max, map_.get_desc(), output_.get_desc(), two, two, none, none}, engine_, forward});
}

void ConvolutionStage::create_backward_weights() {
  group_ = shape_.in_channels;
  if (prefers_product(shape_)) {
    const auto pixels = [&](int channels) {
      return memory(floats({shape_.batch, channels, shape_.size, shape_.size}, Tag::nhwc), engine_);
    };
    input_for_weights_ = pixels(shape_.in_channels);
    map_gradient_for_weights_ = pixels(shape_.out_channels);
    weights_gradient_ = memory(weights_of(shape_, Tag::ohwi), engine_);
    return;
  }
  input_for_weights_ = input_;
  map_gradient_for_weights_ = map_gradient_;
  dnnl::convolution_backward_weights::primitive_desc description = describe_backward_weights();
  // The first stage reads plain channels. For three of them oneDNN has vector code on all processors, for fewer only on
  // some, and for more it may have a slow one: three at a time, beside fewer zeros.
  constexpr int plain = 3;
  const bool slow = std::string_view(description.impl_info_str()).substr(0, 3) == "ref";
  if (!input_gradient_ && ((group_ > plain && group_ < 16) || (group_ < plain && slow))) {
    group_ = plain;
    input_for_weights_ = memory(floats({shape_.batch, group_, shape_.size, shape_.size}, Tag::nchw), engine_);
    std::fill_n(values(input_for_weights_), input_for_weights_.get_desc().get_size() / sizeof(float), 0.0f);
    description = describe_backward_weights();
  }
  weights_gradient_ = memory(description.diff_weights_desc(), engine_);
  backward_weights_ = dnnl::convolution_backward_weights(description);
}

// Description for group_ input channels, from input_for_weights_.
dnnl::convolution_backward_weights::primitive_desc ConvolutionStage::describe_backward_weights() const {
  ConvolutionShape shape = shape_;
  shape.in_channels = group_;
  const bool winograd = prefers_winograd(shape);
  const auto forward = describe_forward(engine_, shape, input_for_weights_.get_desc(), winograd);
  return winograd_or_direct(winograd, [&](algorithm chosen) {
    return dnnl::convolution_backward_weights::primitive_desc(
        {chosen, input_for_weights_.get_desc(), weights_of(shape), floats({shape.out_channels}, Tag::x),
         map_.get_desc(), one, one, one},
        engine_, forward, true);
  });
}

void ConvolutionStage::create_backward_input() {
  const auto description = winograd_or_direct(prefers_winograd(shape_), [&](algorithm chosen) {
    return dnnl::convolution_backward_data::primitive_desc(
        {chosen, input_.get_desc(), weights_of(shape_), map_.get_desc(), one, one, one}, engine_, forward_description_,
        true);
  });
  weights_for_input_gradient_ = memory(description.weights_desc(), engine_);
  backward_input_ = dnnl::convolution_backward_data(description);
}

void ConvolutionStage::forward(dnnl::stream& stream, const float* weights, const float* bias) {
  reorder(stream, as_memory(weights_of(shape_, Tag::oihw), engine_, weights), weights_);
  forward_.execute(stream, {{DNNL_ARG_SRC, input_},
                            {DNNL_ARG_WEIGHTS, weights_},
                            {DNNL_ARG_BIAS, as_memory(floats({shape_.out_channels}, Tag::x), engine_, bias)},
                            {DNNL_ARG_DST, map_}});
  if (shape_.size > 1)
    pool_.execute(stream, {{DNNL_ARG_SRC, map_}, {DNNL_ARG_DST, output_}, {DNNL_ARG_WORKSPACE, pooled_from_}});
  stream.wait();
}

void ConvolutionStage::backward(dnnl::stream& stream, const float* weights, float* weights_gradient,
                                float* bias_gradient) {
  // ReLU passes the gradient on where its output is above 0; of each four pixels only the greatest gets any, so it is
  // enough to ask the pooled ones.
  const auto count = static_cast<std::ptrdiff_t>(output_.get_desc().get_size() / sizeof(float));
  const float* const output = values(output_);
  float* const gradient = values(output_gradient_);
#pragma omp parallel for
  for (std::ptrdiff_t i = 0; i < count; ++i)
    if (!(output[i] > 0)) gradient[i] = 0;
  if (shape_.size > 1)
    unpool_.execute(stream, {{DNNL_ARG_DIFF_DST, output_gradient_},
                             {DNNL_ARG_WORKSPACE, pooled_from_},
                             {DNNL_ARG_DIFF_SRC, map_gradient_}});

  if (prefers_product(shape_))
    weights_gradient_by_product(stream, weights_gradient, bias_gradient);
  else
    weights_gradient_by_convolution(stream, weights_gradient, bias_gradient);
  if (input_gradient_) {
    reorder(stream, as_memory(weights_of(shape_, Tag::oihw), engine_, weights), weights_for_input_gradient_);
    backward_input_.execute(stream, {{DNNL_ARG_DIFF_DST, map_gradient_},
                                     {DNNL_ARG_WEIGHTS, weights_for_input_gradient_},
                                     {DNNL_ARG_DIFF_SRC, input_gradient_}});
  }
  stream.wait();
}

void ConvolutionStage::weights_gradient_by_convolution(dnnl::stream& stream, float* weights_gradient,
                                                       float* bias_gradient) {
  const int count = std::min(group_, shape_.in_channels);  // of channels at a time
  const memory::dims input_dims{shape_.batch, count, shape_.size, shape_.size};
  const memory::dims weights_dims{shape_.out_channels, count, 3, 3}, begin{0, 0, 0, 0};
  const auto part = [&](const memory& of, const memory::dims& dims, const memory::dims& offset) {
    return as_memory(of.get_desc().submemory_desc(dims, offset), engine_, values(of));
  };
  for (int channel = 0; channel < shape_.in_channels; channel += count) {
    // The last group begins earlier where no whole one is left: some channels come twice.
    const memory::dims offset{0, std::min(channel, shape_.in_channels - count), 0, 0};
    if (group_ != shape_.in_channels)
      reorder(stream, part(input_, input_dims, offset), part(input_for_weights_, input_dims, begin));
    backward_weights_.execute(
        stream, {{DNNL_ARG_SRC, input_for_weights_},
                 {DNNL_ARG_DIFF_DST, map_gradient_for_weights_},
                 {DNNL_ARG_DIFF_WEIGHTS, weights_gradient_},
                 {DNNL_ARG_DIFF_BIAS, as_memory(floats({shape_.out_channels}, Tag::x), engine_, bias_gradient)}});
    reorder(stream, part(weights_gradient_, weights_dims, begin),
            as_memory(weights_of(shape_, Tag::oihw).submemory_desc(weights_dims, offset), engine_, weights_gradient));
  }
}

void ConvolutionStage::weights_gradient_by_product(dnnl::stream& stream, float* weights_gradient,
                                                   float* bias_gradient) {
  reorder(stream, input_, input_for_weights_);
  reorder(stream, map_gradient_, map_gradient_for_weights_);
  stream.wait();
  const auto in = static_cast<std::size_t>(shape_.in_channels), out = static_cast<std::size_t>(shape_.out_channels);
  const std::vector<float> neighbours = neighbours_of_pixels(shape_, values(input_for_weights_));
  const std::size_t pixels = neighbours.size() / (9 * in);
  const float* const gradient = values(map_gradient_for_weights_);

  // (out, pixels) times (pixels, 9 in)
  const auto rows = static_cast<memory::dim>(out), columns = static_cast<memory::dim>(9 * in);
  dnnl::sgemm('T', 'N', rows, columns, static_cast<memory::dim>(pixels), 1, gradient, rows, neighbours.data(), columns,
              0, values(weights_gradient_), columns);
  reorder(stream, weights_gradient_, as_memory(weights_of(shape_, Tag::oihw), engine_, weights_gradient));

  std::fill_n(bias_gradient, out, 0.0f);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel)
    for (std::size_t o = 0; o < out; ++o) bias_gradient[o] += gradient[pixel * out + o];
}

}  // namespace itn
