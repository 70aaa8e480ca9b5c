#include "itn/network.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <omp.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <oneapi/dnnl/dnnl.hpp>
#include <utility>

#include "itn/error.h"
#include "network/model/convolution.h"
#include "network/model/fully_connected.h"
#include "network/model/random.h"
#include "network/model/threads.h"

namespace itn {
namespace {

std::size_t features_of(const NetworkDescription& description) {
  return static_cast<std::size_t>(description.width) << (NETWORK_STAGES - 1);
}

void check(const NetworkDescription& description) {
  const std::array<const char*, 4> kinds{"rn", "itn", "ssn", judge_kind};
  if (std::find(kinds.begin(), kinds.end(), description.kind) == kinds.end())
    throw UsageError("network kind '" + description.kind + "': must be rn, itn, ssn or judge");
  if (!(description.limit >= 0 && description.limit <= 1))
    throw UsageError("network with the limit " + std::to_string(description.limit) + ": must be 0 to 1");
  if (is_judge(description) && (description.outputs.size() < 2 || description.outputs.front().name != "doubt"))
    throw UsageError("network: a judge has a doubt and at least one fault as outputs");
  if (const int channels = channels_of(inputs_of(description)); channels != description.channels)
    throw UsageError("network with " + std::to_string(description.channels) + " input channels: what it sees has " +
                     std::to_string(channels));
  if (description.size < 1 || description.size > 128 || !std::has_single_bit(static_cast<unsigned>(description.size)))
    throw UsageError("network for images of " + std::to_string(description.size) +
                     " pixels: must be a power of two, up to 128");
  if (description.width < 1 || description.width > 64)
    throw UsageError("network with " + std::to_string(description.width) +
                     " channels in its first stage: must be 1 to 64");
  if (!(description.luminance > 0 && std::isfinite(description.luminance)))
    throw UsageError("network for images of luminance " + std::to_string(description.luminance) + ": must be above 0");
  if (!(description.mm_per_unit > 0 && std::isfinite(description.mm_per_unit)))
    throw UsageError("network for scene units of " + std::to_string(description.mm_per_unit) + " mm: must be above 0");
  if (description.cut_out != 0 && !(description.cut_out > 0.01 && description.cut_out <= 1))
    throw UsageError("network of objects that take " + std::to_string(description.cut_out) +
                     " of an image's side: must be 0.01 to 1, or 0 where it sees all of it");
  if (description.cut_out > 0) {
    if (!sees(description, "mask")) throw UsageError("network that sees the object alone: must see a mask of it");
    for (const char* known : {"normal", "nearness", "light"})
      if (sees(description, known))
        throw UsageError("network that sees the object alone: cannot see '" + std::string(known) + "'");
  }
  check_outputs(description.outputs);
  if (description.distribution && description.kind != "rn")
    throw UsageError("network kind '" + description.kind + "': only rn learns a distribution");
  if (description.spread.size() != (description.distribution ? description.outputs.size() : 0) ||
      !std::all_of(description.spread.begin(), description.spread.end(),
                   [](double spread) { return spread > 0 && std::isfinite(spread); }))
    throw UsageError("network: need a spread above 0 for each output of a distribution, and none without one");
}

// Names and shapes; no values yet.
std::vector<Tensor> weight_shapes(const NetworkDescription& description) {
  std::vector<Tensor> tensors;
  const auto add = [&](std::string name, std::vector<std::size_t> shape) {
    tensors.push_back({std::move(name), std::move(shape), {}});
  };
  auto in = static_cast<std::size_t>(description.channels);
  auto out = static_cast<std::size_t>(description.width);
  for (int stage = 0; stage < NETWORK_STAGES; ++stage) {
    add("convolution" + std::to_string(stage) + ".weight", {out, in, 3, 3});
    add("convolution" + std::to_string(stage) + ".bias", {out});
    in = std::exchange(out, 2 * out);
  }
  add("fully_connected.weight", {description.raw_outputs(), in});
  add("fully_connected.bias", {description.raw_outputs()});
  return tensors;
}

std::vector<Tensor> empty_weights(const NetworkDescription& description) {
  std::vector<Tensor> tensors = weight_shapes(description);
  for (Tensor& tensor : tensors) tensor.values.resize(count_of(tensor.shape));
  return tensors;
}

// oneDNN has vector code for whole blocks of channels: a narrower stage computes some more, whose weights are 0.
int whole_blocks(int channels) {
  constexpr int block = 16;
  return (channels + block - 1) / block * block;
}

// A stage's kernels (out, in, 3, 3) or bias (out), as it computes them, where that is wider.
class WidenedTensor {
 public:
  // in: channels of its images; of a bias 1.
  WidenedTensor(const Tensor& of, int out, int in)
      : rows_(of.shape[0]),
        row_(count_of(of.shape) / rows_),
        wide_row_(of.shape.size() == 1 ? 1 : 9 * static_cast<std::size_t>(in)),
        values_(static_cast<std::size_t>(out) * wide_row_ > rows_ * row_ ? static_cast<std::size_t>(out) * wide_row_
                                                                         : 0) {}

  bool is_wider() const { return !values_.empty(); }
  const float* take(const Tensor& from) {
    for (std::size_t r = 0; r < rows_; ++r) std::copy_n(&from.values[r * row_], row_, &values_[r * wide_row_]);
    return values_.data();
  }
  float* values() { return values_.data(); }
  void give(Tensor& to) const {
    for (std::size_t r = 0; r < rows_; ++r) std::copy_n(&values_[r * wide_row_], row_, &to.values[r * row_]);
  }

 private:
  std::size_t rows_, row_, wide_row_;
  std::vector<float> values_;
};

float* data(const dnnl::memory& memory) { return static_cast<float*>(memory.get_data_handle()); }

}  // namespace

std::vector<std::string> inputs_of(const NetworkDescription& description) {
  if (!description.inputs.empty()) return description.inputs;
  if (description.channels == 1) return {"luminance"};
  if (description.channels == 6) return {"luminance", "normal", "nearness", "light"};
  throw UsageError("network with " + std::to_string(description.channels) +
                   " input channels: must be 1 (luminance) or 6 (known shape and light), or say what they are");
}

bool sees(const NetworkDescription& description, const std::string& input) {
  const std::vector<std::string> inputs = inputs_of(description);
  return std::find(inputs.begin(), inputs.end(), input) != inputs.end();
}

bool is_judge(const NetworkDescription& description) { return description.kind == judge_kind; }

bool is_plain(const NetworkDescription& description) {
  return description.inputs.empty() && !description.exposure && !is_judge(description);
}

std::string beyond_plain(const NetworkDescription& description) {
  if (is_judge(description)) return "judges photos, and says no materials";
  if (description.inputs.empty()) return "does not know exposures";
  return fmt::format("sees {}", fmt::join(description.inputs, ", "));
}

int channels_of_input(const std::string& input) {
  const auto kind =
      std::find_if(input_kinds.begin(), input_kinds.end(), [&](const InputKind& k) { return k.name == input; });
  if (kind == input_kinds.end()) throw UsageError("network that sees '" + input + "': is not known");
  return kind->channels;
}

int channels_of(const std::vector<std::string>& inputs) {
  int channels = 0;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    if (std::find(inputs.begin(), inputs.begin() + static_cast<std::ptrdiff_t>(i), inputs[i]) !=
        inputs.begin() + static_cast<std::ptrdiff_t>(i))
      throw UsageError("network that sees '" + inputs[i] + "' twice: once is enough");
    channels += channels_of_input(inputs[i]);
  }
  const auto has = [&](const char* name) { return std::find(inputs.begin(), inputs.end(), name) != inputs.end(); };
  if (has("luminance") == has("rgb"))
    throw UsageError("network: must see an image, either its luminance or its colours (rgb)");
  return channels;
}

struct Network::Pass {
  dnnl::engine engine{dnnl::engine::kind::cpu, 0};
  dnnl::stream stream{engine};
  dnnl::memory images;
  std::vector<ConvolutionStage> stages;
  std::vector<WidenedTensor> weights, gradients;  // as Network's, of the stages
  std::vector<float> output;
  FullyConnectedShape last;

  Pass(const NetworkDescription& description, int batch)
      : last{static_cast<std::size_t>(batch), features_of(description), description.raw_outputs()} {
    images = dnnl::memory({{batch, description.channels, description.size, description.size},
                           dnnl::memory::data_type::f32,
                           dnnl::memory::format_tag::nchw},
                          engine);
    ConvolutionShape shape{batch, description.channels, whole_blocks(description.width), description.size};
    const std::vector<Tensor> narrow = weight_shapes(description);
    for (int stage = 0; stage < NETWORK_STAGES; ++stage) {
      if (stage == 0)
        stages.emplace_back(engine, shape, images, dnnl::memory());
      else
        stages.emplace_back(engine, shape, stages.back().output(), stages.back().output_gradient());
      for (std::size_t part = 0; part < 2; ++part)
        weights.emplace_back(narrow[2 * static_cast<std::size_t>(stage) + part], shape.out_channels, shape.in_channels);
      shape.in_channels = std::exchange(shape.out_channels, whole_blocks(description.width << (stage + 1)));
      shape.size = std::max(1, shape.size / 2);
    }
    gradients = weights;
    output.resize(last.batch * last.outputs);
  }

  const float* widened(const std::vector<Tensor>& own, std::size_t i) {
    return weights[i].is_wider() ? weights[i].take(own[i]) : own[i].values.data();
  }

  // The last stage's images have one pixel, so that every layout is (batch, channels).
  float* features() { return data(stages.back().output()); }
  float* features_gradient() { return data(stages.back().output_gradient()); }
};

std::size_t weight_count(const NetworkDescription& description) {
  check(description);
  std::size_t count = 0;
  for (const Tensor& tensor : weight_shapes(description)) count += count_of(tensor.shape);
  return count;
}

Network::Network(NetworkDescription description) : description_(std::move(description)) {
  check(description_);
  limit_threads();
  omp_set_dynamic(0);  // OMP_DYNAMIC: oneDNN waits for ever for threads that OpenMP leaves away
  weights_ = gradients_ = empty_weights(description_);
}

Network::~Network() = default;
Network::Network(Network&&) noexcept = default;
Network& Network::operator=(Network&&) noexcept = default;

void Network::set_spread(std::vector<double> spread) {
  NetworkDescription description = description_;
  description.spread = std::move(spread);
  check(description);
  description_ = std::move(description);
}

void Network::set_limit(double limit) {
  NetworkDescription description = description_;
  description.limit = limit;
  check(description);
  description_ = std::move(description);
}

void Network::initialise(std::uint64_t seed) {
  for (std::size_t layer = 0; layer < weights_.size(); ++layer) {
    Tensor& weight = weights_[layer];
    const bool is_bias = weight.shape.size() == 1;
    const std::size_t inputs = weight.values.size() / weight.shape[0];
    const double deviation = is_bias ? 0 : std::sqrt(2 / static_cast<double>(inputs));
    for (std::size_t i = 0; i < weight.values.size(); ++i)
      weight.values[i] = static_cast<float>(deviation * random_normal(seed, RANDOM_WEIGHTS + layer, i));
  }
}

std::size_t Network::image_values() const {
  const auto size = static_cast<std::size_t>(description_.size);
  return static_cast<std::size_t>(description_.channels) * size * size;
}

const std::vector<float>& Network::forward(std::span<const float> images, int batch) {
  if (batch < 1 || images.size() != static_cast<std::size_t>(batch) * image_values())
    throw UsageError("a batch of " + std::to_string(batch) + " images with " + std::to_string(images.size()) +
                     " numbers, where one has " + std::to_string(image_values()));
  std::unique_ptr<Pass>& pass = passes_[batch];
  if (!pass) pass = std::make_unique<Pass>(description_, batch);
  last_pass_ = pass.get();

  std::copy(images.begin(), images.end(), data(pass->images));
  for (std::size_t stage = 0; stage < NETWORK_STAGES; ++stage)
    pass->stages[stage].forward(pass->stream, pass->widened(weights_, 2 * stage),
                                pass->widened(weights_, 2 * stage + 1));
  fully_connected(pass->last, pass->features(), weights_[2 * NETWORK_STAGES].values.data(),
                  weights_[2 * NETWORK_STAGES + 1].values.data(), pass->output.data());
  return pass->output;
}

void Network::backward(std::span<const float> output_gradient) {
  Pass* const pass = last_pass_;
  if (!pass || output_gradient.size() != pass->output.size())
    throw UsageError("the gradient by the outputs does not belong to the last batch");
  fully_connected_backward(pass->last, pass->features(), weights_[2 * NETWORK_STAGES].values.data(),
                           output_gradient.data(), pass->features_gradient(),
                           gradients_[2 * NETWORK_STAGES].values.data(),
                           gradients_[2 * NETWORK_STAGES + 1].values.data());
  for (std::size_t stage = NETWORK_STAGES; stage-- > 0;) {
    const std::array<std::size_t, 2> parts{2 * stage, 2 * stage + 1};
    const auto own = [&](std::size_t i) {
      return pass->gradients[i].is_wider() ? pass->gradients[i].values() : gradients_[i].values.data();
    };
    pass->stages[stage].backward(pass->stream, pass->widened(weights_, parts[0]), own(parts[0]), own(parts[1]));
    for (const std::size_t i : parts)
      if (pass->gradients[i].is_wider()) pass->gradients[i].give(gradients_[i]);
  }
}

}  // namespace itn
