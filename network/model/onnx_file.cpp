#include "network/model/onnx_file.h"

#include <cmath>
#include <cstdint>
#include <utility>

#include "itn/network_file.h"
#include "itn/version.h"
#include "network/model/input.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

// A message of Protocol Buffers (protobuf.dev, "Encoding"), as far as ONNX needs it. The numbers of the fields are
// those of onnx.proto3.
class Message {
 public:
  Message& number(int field, std::uint64_t value) {
    tag(field, 0);
    varint(value);
    return *this;
  }
  Message& text(int field, const std::string& value) {
    tag(field, 2);
    varint(value.size());
    bytes_ += value;
    return *this;
  }
  Message& message(int field, const Message& value) { return text(field, value.bytes_); }
  const std::string& bytes() const { return bytes_; }

 private:
  void tag(int field, unsigned type) { varint(static_cast<std::uint64_t>(field) << 3 | type); }
  void varint(std::uint64_t value) {
    for (; value >= 128; value >>= 7) bytes_ += static_cast<char>(value % 128 | 128);
    bytes_ += static_cast<char>(value);
  }

  std::string bytes_;
};

using Shape = std::vector<std::size_t>;
using Names = std::vector<std::string>;

constexpr std::uint64_t type_float = 1, type_bool = 9, attribute_int = 2, attribute_ints = 7;

Message attribute(const std::string& name, std::uint64_t value) {
  return Message().text(1, name).number(3, value).number(20, attribute_int);
}
Message attribute(const std::string& name, const std::vector<std::uint64_t>& values) {
  Message message;
  message.text(1, name);
  for (const std::uint64_t value : values) message.number(8, value);
  return message.number(20, attribute_ints);
}

// Shape 0: as many as the caller likes.
Message value_info(const std::string& name, const Shape& shape) {
  Message dimensions;
  for (const std::size_t size : shape)
    dimensions.message(1, size == 0 ? Message().text(2, "batch") : Message().number(1, size));
  const Message tensor = Message().number(1, type_float).message(2, dimensions);
  return Message().text(1, name).message(2, Message().message(1, tensor));
}

class Graph {
 public:
  // A node of one output, which gives it its name.
  void node(const std::string& type, const Names& inputs, const std::string& output,
            const std::vector<Message>& attributes = {}) {
    Message node;
    for (const std::string& input : inputs) node.text(1, input);
    node.text(2, output).text(3, output).text(4, type);
    for (const Message& a : attributes) node.message(5, a);
    graph_.message(1, node);
  }
  void constant(const std::string& name, const Shape& shape, const std::vector<float>& values) {
    initializer(name, shape, type_float, {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)});
  }
  void constant(const std::string& name, const Shape& shape, const std::vector<bool>& values) {
    std::string raw;
    for (const bool value : values) raw += static_cast<char>(value);
    initializer(name, shape, type_bool, raw);
  }
  void input(const std::string& name, const Shape& shape) { graph_.message(11, value_info(name, shape)); }
  void output(const std::string& name, const Shape& shape) { graph_.message(12, value_info(name, shape)); }
  Message named(const std::string& name) { return graph_.text(2, name); }

 private:
  void initializer(const std::string& name, const Shape& shape, std::uint64_t type, const std::string& raw) {
    Message tensor;
    for (const std::size_t size : shape) tensor.number(1, size);
    graph_.message(5, tensor.number(2, type).text(8, name).text(9, raw));
  }

  Message graph_;
};

constexpr const char* known_input = "known";

// The graph that makes the network's input from its parts, as in input.h.
class InputGraph {
 public:
  InputGraph(Graph& graph, const NetworkDescription& network)
      : graph_(graph), network_(network), inputs_(onnx_inputs(network)) {
    const auto side = static_cast<std::size_t>(network.size);
    for (const std::string& name : inputs_) {
      const int channels = name == known_input ? network.channels - 1 : channels_of_input(name);
      graph_.input(name, {0, static_cast<std::size_t>(channels), side, side});
    }
    const auto dark = static_cast<float>(darkest_radiance);
    const auto unit = static_cast<float>(network.luminance);
    graph_.constant("dark", {}, std::vector<float>{network.exposure ? dark : dark * unit});
    if (network.exposure)
      graph_.constant("least", {}, std::vector<float>{static_cast<float>(least_mean)});
    else
      graph_.constant("middle", {}, std::vector<float>{unit + dark * unit});
    if (network.cut_out > 0 && network.exposure) mean_of("mask");
  }

  // Returns the name of what the first stage sees.
  std::string all() {
    Names seen;
    for (const std::string& name : inputs_) {
      const bool of_light = name.ends_with("luminance") || name.ends_with("rgb");
      if (of_light || name == known_input || sees(network_, name)) seen.push_back(of_light ? radiance(name) : name);
    }
    if (seen.size() == 1) return seen.front();
    graph_.node("Concat", seen, "all", {attribute("axis", 1)});
    return "all";
  }

 private:
  std::string mean_of(const std::string& name) {
    graph_.node("ReduceMean", {name}, name + ".mean", {attribute("axes", std::vector<std::uint64_t>{1, 2, 3})});
    return name + ".mean";
  }

  std::string radiance(const std::string& name) {
    std::string shown = name, dark = "dark", middle = "middle";
    if (network_.cut_out > 0) graph_.node("Mul", {name, "mask"}, shown = name + ".object");
    if (network_.exposure) {
      std::string mean = mean_of(shown);
      if (network_.cut_out > 0) graph_.node("Div", {std::exchange(mean, name + ".unit"), "mask.mean"}, name + ".unit");
      graph_.node("Max", {mean, "least"}, name + ".above_0");
      graph_.node("Mul", {name + ".above_0", "dark"}, dark = name + ".dark");
      graph_.node("Add", {name + ".above_0", dark}, middle = name + ".middle");
    }
    graph_.node("Relu", {shown}, name + ".light");
    graph_.node("Add", {name + ".light", dark}, name + ".brighter");
    graph_.node("Div", {name + ".brighter", middle}, name + ".relative");
    graph_.node("Log", {name + ".relative"}, name + ".seen");
    return name + ".seen";
  }

  Graph& graph_;
  const NetworkDescription& network_;
  Names inputs_;
};

std::string add_stages(Graph& graph, const Network& network, std::string seen) {
  int size = network.description().size;
  for (std::size_t stage = 0; stage < NETWORK_STAGES; ++stage) {
    const std::string name = "convolution" + std::to_string(stage);
    for (const Tensor* tensor : {&network.weights()[2 * stage], &network.weights()[2 * stage + 1]})
      graph.constant(tensor->name, tensor->shape, tensor->values);
    graph.node("Conv", {seen, name + ".weight", name + ".bias"}, name,
               {attribute("kernel_shape", std::vector<std::uint64_t>{3, 3}),
                attribute("pads", std::vector<std::uint64_t>{1, 1, 1, 1})});
    seen = name + ".relu";
    graph.node("Relu", {name}, seen);
    if (size == 1) continue;
    graph.node("MaxPool", {std::exchange(seen, name + ".pool")}, name + ".pool",
               {attribute("kernel_shape", std::vector<std::uint64_t>{2, 2}),
                attribute("strides", std::vector<std::uint64_t>{2, 2})});
    size /= 2;
  }
  return seen;
}

// Rows [first, first + count) of the last layer, of "features".
void add_last(Graph& graph, const Network& network, const std::string& name, std::size_t first, std::size_t count) {
  const Tensor &weight = network.weights()[2 * NETWORK_STAGES], &bias = network.weights()[2 * NETWORK_STAGES + 1];
  const std::size_t inputs = weight.shape[1];
  const auto rows = [&](const std::vector<float>& values, std::size_t length) {
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first * length);
    return std::vector<float>(begin, begin + static_cast<std::ptrdiff_t>(count * length));
  };
  graph.constant(name + ".weight", {count, inputs}, rows(weight.values, inputs));
  graph.constant(name + ".bias", {count}, rows(bias.values, 1));
  graph.node("Gemm", {"features", name + ".weight", name + ".bias"}, name, {attribute("transB", 1)});
}

// The output `name` of shares: low + (high - low) share, or low (high / low)^share (output_range.h).
void add_parameters(Graph& graph, const std::string& share, const std::string& name, std::size_t count) {
  graph.node("Mul", {share, "range"}, name + ".above_low");
  graph.node("Add", {name + ".above_low", "lowest"}, name + ".coordinate");
  graph.node("Exp", {name + ".coordinate"}, name + ".exponential");
  graph.node("Where", {"logarithmic", name + ".exponential", name + ".coordinate"}, name);
  graph.output(name, {0, count});
}

// Ends of the intervals of 95 % (distribution.h).
void add_intervals(Graph& graph, const Network& network) {
  const std::size_t count = network.description().outputs.size();
  add_last(graph, network, "log_deviation", count, count);
  std::vector<float> half;
  for (const double spread : network.description().spread)
    half.push_back(static_cast<float>(normal_quantile(0.975) * spread / std::sqrt(12.0)));
  graph.constant("half", {count}, half);
  graph.constant("share_of_low", {}, std::vector<float>{0});
  graph.constant("share_of_high", {}, std::vector<float>{1});
  graph.node("Exp", {"log_deviation"}, "deviation");
  graph.node("Mul", {"deviation", "half"}, "way");
  for (const auto& [operation, name] : {std::pair{"Sub", "low"}, {"Add", "high"}}) {
    graph.node(operation, {"share", "way"}, std::string(name) + ".end");
    graph.node("Clip", {std::string(name) + ".end", "share_of_low", "share_of_high"}, std::string(name) + ".share");
    add_parameters(graph, std::string(name) + ".share", name, count);
  }
}

void add_outputs(Graph& graph, const Network& network) {
  const std::vector<OutputRange>& outputs = network.description().outputs;
  std::vector<float> low, range;
  std::vector<bool> logarithmic;
  for (const OutputRange& o : outputs) {
    low.push_back(static_cast<float>(o.logarithmic ? std::log(o.low) : o.low));
    range.push_back(static_cast<float>(o.logarithmic ? std::log(o.high / o.low) : o.high - o.low));
    logarithmic.push_back(o.logarithmic);
  }
  graph.constant("lowest", {outputs.size()}, low);
  graph.constant("range", {outputs.size()}, range);
  graph.constant("logarithmic", {outputs.size()}, logarithmic);
  add_last(graph, network, "fully_connected", 0, outputs.size());
  graph.node("Sigmoid", {"fully_connected"}, "share");
  add_parameters(graph, "share", "parameters", outputs.size());
  if (network.description().distribution) add_intervals(graph, network);
}

}  // namespace

std::vector<std::string> onnx_inputs(const NetworkDescription& network) {
  if (is_plain(network)) return network.channels > 1 ? Names{"luminance", known_input} : Names{"luminance"};
  Names names = inputs_of(network);
  if (network.cut_out > 0 && !sees(network, "mask")) names.emplace_back("mask");
  return names;
}

std::vector<std::string> onnx_outputs(const NetworkDescription& network) {
  return network.distribution ? Names{"parameters", "low", "high"} : Names{"parameters"};
}

std::string onnx_bytes(const Network& network) {
  const NetworkDescription& description = network.description();
  Graph graph;
  const std::string features = add_stages(graph, network, InputGraph(graph, description).all());
  graph.node("Flatten", {features}, "features");
  add_outputs(graph, network);

  constexpr std::uint64_t ir_version = 7, operators = 13;
  Message model;
  model.number(1, ir_version).text(2, "itn").text(3, version()).message(7, graph.named("itn"));
  model.message(8, Message().text(1, "").number(2, operators));
  for (const auto& [key, value] : network_metadata(description))
    model.message(14, Message().text(1, key).text(2, value));
  return model.bytes();
}

}  // namespace itn
