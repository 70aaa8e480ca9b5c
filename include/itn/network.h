// The paper's network (section 5; after Liu et al. 2017): seven convolution stages (convolution.h), each with twice the
// channels of the one before, 16, 32, ..., 1024 in the paper, and one fully connected layer to as many raw outputs as
// there are parameters to predict.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "itn/output_range.h"
#include "itn/tensor.h"

namespace itn {

constexpr int NETWORK_STAGES = 7;
constexpr const char* judge_kind = "judge";

struct NetworkDescription {
  // Training method: rn (supervised), itn (and by full transport), ssn (and by single scattering); or judge, for a
  // judge (judge.h).
  std::string kind = "rn";
  int channels = 1;  // of what it sees: those of `inputs`
  int size = 128;    // side of the square images [pixels]: a power of two, up to 128
  std::vector<OutputRange> outputs = default_outputs();
  int width = 16;  // channels of the first stage, 1 to 64; the last has 64 times as many
  // Properties of the images that it learnt from:
  double luminance = 1;    // the radiance that becomes 0 in its input (input.h), > 0
  double mm_per_unit = 1;  // sigma_t [1/mm] times it is per scene unit, > 0
  // Says how sure it is, too: raw outputs are those of distribution.h, else one for each of `outputs`. Of an rn alone.
  bool distribution = false;
  // The distribution's standard deviations times these hold what they say on held-out examples; one an output, > 0.
  std::vector<double> spread{};
  // Judges only: the doubt (judge.h) that 5 % of what it should not doubt exceed, 0 to 1.
  double limit = 1;
  // Names of its inputs, one after the other (input.h). Empty: with one channel "luminance", with six "luminance",
  // "normal", "nearness" and "light".
  std::vector<std::string> inputs{};
  // Each image, and the flash's light, is known up to a factor: what it sees is over its own mean, and not over
  // `luminance`.
  bool exposure = false;
  // Above 0: it sees the object alone, by its mask, and black around it, always of the same size: the longer side of
  // the box around the mask takes this share of the side of what it sees, as in the images that it learnt from in the
  // mean.
  double cut_out = 0;

  std::size_t raw_outputs() const {
    const std::size_t n = outputs.size();
    return distribution ? 2 * n + n * (n - 1) / 2 : n;
  }

  friend bool operator==(const NetworkDescription&, const NetworkDescription&) = default;
};

// Kinds of inputs, and their numbers of channels.
struct InputKind {
  const char* name;
  int channels;
};
constexpr std::array<InputKind, 8> input_kinds{{{"luminance", 1},
                                                {"rgb", 3},
                                                {"flash_luminance", 1},
                                                {"flash_rgb", 3},
                                                {"mask", 1},
                                                {"normal", 3},
                                                {"nearness", 1},
                                                {"light", 1}}};

// `inputs`, filled in where it is empty. Throws UsageError: channels that are neither one nor six.
std::vector<std::string> inputs_of(const NetworkDescription& description);
int channels_of_input(const std::string& input);  // of one of input_kinds
bool sees(const NetworkDescription& description, const std::string& input);
bool is_judge(const NetworkDescription& description);
// Does it predict materials, from luminance of a known exposure, with either nothing else or all of known shape and
// light?
bool is_plain(const NetworkDescription& description);
// The features beyond that, for messages: "does not know exposures".
std::string beyond_plain(const NetworkDescription& description);
// The channels of all. Throws UsageError: no image among them, an input that is not known or there twice.
int channels_of(const std::vector<std::string>& inputs);

// Number of its weights. Throws UsageError as Network().
std::size_t weight_count(const NetworkDescription& description);

class Network {
 public:
  // All weights 0. Throws UsageError: a kind, size or number of channels not named above; wrong outputs.
  explicit Network(NetworkDescription description);
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) noexcept;

  // Weights normal with variance 2 / (inputs of the layer) (He et al. 2015), a function of the seed; biases 0.
  void initialise(std::uint64_t seed);

  // images: (batch, channels, size, size), row-major, finite. Returns the raw outputs (batch, raw_outputs), row-major.
  const std::vector<float>& forward(std::span<const float> images, int batch);

  // After forward(): the loss's gradient by the raw outputs, laid out as they are, becomes gradients().
  void backward(std::span<const float> output_gradient);

  const NetworkDescription& description() const { return description_; }
  // Sets the spread of the distribution. Throws UsageError: not one above 0 for each output of a network that predicts
  // a distribution.
  void set_spread(std::vector<double> spread);
  // Sets the limit of a judge. Throws UsageError: not from 0 to 1.
  void set_limit(double limit);
  std::size_t image_values() const;  // channels * size * size

  // In a fixed order: weight (out, in, 3, 3) and bias of every stage, weight (raw_outputs, 1024) and bias of the last
  // layer. They do not depend on the size of the images.
  std::vector<Tensor>& weights() { return weights_; }
  const std::vector<Tensor>& weights() const { return weights_; }
  const std::vector<Tensor>& gradients() const { return gradients_; }
  std::vector<Tensor>& gradients() { return gradients_; }  // for who adds up those of several batches

 private:
  struct Pass;  // activations and gradients of one batch size

  NetworkDescription description_;
  std::vector<Tensor> weights_, gradients_;
  std::map<int, std::unique_ptr<Pass>> passes_;
  Pass* last_pass_ = nullptr;
};

}  // namespace itn
