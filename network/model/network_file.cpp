#include "itn/network_file.h"

#include <charconv>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/json_text.h"

namespace itn {
namespace {

constexpr const char* FORMAT = "itn.network";
constexpr const char* VERSION = "1";
constexpr const char* DISTRIBUTION = "normal";  // of distribution.h

int whole_number(const Safetensors& content, const std::string& name, const std::string& file) {
  const std::string& text = content.text(name, file);
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size())
    throw InputError(file + ": metadata '" + name + "' is '" + text + "', where a whole number is expected");
  return number;
}

double number(const Safetensors& content, const std::string& name, const std::string& file) {
  const std::string& text = content.text(name, file);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw InputError(file + ": metadata '" + name + "' is '" + text + "', where a number is expected");
  return value;
}

void read_distribution(const Safetensors& content, const std::string& file, NetworkDescription& description) {
  if (content.text("distribution", file) != DISTRIBUTION)
    throw InputError(file + ": metadata 'distribution' is '" + content.text("distribution", file) + "', where '" +
                     DISTRIBUTION + "' is expected");
  description.distribution = true;
  try {
    description.spread = parse_json<nlohmann::json>(content.text("spread", file), file + ": metadata 'spread'")
                             .get<std::vector<double>>();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file + ": metadata 'spread' is no list of numbers: " + error.what());
  }
}

std::string shape_text(const std::vector<std::size_t>& shape) {
  std::string text;
  for (const std::size_t extent : shape) text += (text.empty() ? "" : " x ") + std::to_string(extent);
  return text;
}

// Is it the kernels of a stage whose images are one pixel?
bool sees_one_pixel(const Tensor& weight, const NetworkDescription& description) {
  for (int stage = 0; stage < NETWORK_STAGES; ++stage)
    if (weight.name == "convolution" + std::to_string(stage) + ".weight") return description.size >> stage <= 1;
  return false;
}

std::vector<std::size_t> center_shape(const Tensor& kernels) { return {kernels.shape[0], kernels.shape[1], 1, 1}; }

Tensor centers(const Tensor& kernels) {
  Tensor result{kernels.name, center_shape(kernels), {}};
  for (std::size_t i = 4; i < kernels.values.size(); i += 9) result.values.push_back(kernels.values[i]);
  return result;
}

void set_centers(const Tensor& from, Tensor& kernels) {
  kernels.values.assign(kernels.values.size(), 0.0F);
  for (std::size_t i = 0; i < from.values.size(); ++i) kernels.values[9 * i + 4] = from.values[i];
}

}  // namespace

std::map<std::string, std::string> network_metadata(const NetworkDescription& description) {
  nlohmann::ordered_json outputs = nlohmann::ordered_json::array();
  for (const OutputRange& range : description.outputs)
    outputs.push_back(
        {{"name", range.name}, {"low", range.low}, {"high", range.high}, {"logarithmic", range.logarithmic}});
  std::map<std::string, std::string> all{{"format", FORMAT},
                                         {"version", VERSION},
                                         {"kind", description.kind},
                                         {"channels", std::to_string(description.channels)},
                                         {"size", std::to_string(description.size)},
                                         {"width", std::to_string(description.width)},
                                         {"luminance", nlohmann::json(description.luminance).dump()},
                                         {"mm_per_unit", nlohmann::json(description.mm_per_unit).dump()},
                                         {"outputs", outputs.dump()}};
  if (description.exposure) all["exposure"] = "unknown";
  if (description.cut_out > 0) all["cut_out"] = nlohmann::json(description.cut_out).dump();
  if (!description.inputs.empty()) all["inputs"] = nlohmann::json(description.inputs).dump();
  if (is_judge(description)) all["limit"] = nlohmann::json(description.limit).dump();
  if (description.distribution) {
    all["distribution"] = DISTRIBUTION;
    all["spread"] = nlohmann::json(description.spread).dump();
  }
  return all;
}

NetworkDescription network_description(const Safetensors& content, const std::string& file) {
  if (content.text("format", file) != FORMAT)
    throw InputError(file + ": holds '" + content.text("format", file) + "', where '" + FORMAT + "' is expected");
  if (content.text("version", file) != VERSION)
    throw InputError(file + ": is of version " + content.text("version", file) + ", and this program reads version " +
                     VERSION + "; use the program that wrote it, or train again");
  NetworkDescription description;
  description.kind = content.text("kind", file);
  description.channels = whole_number(content, "channels", file);
  description.size = whole_number(content, "size", file);
  description.width = whole_number(content, "width", file);
  description.luminance = number(content, "luminance", file);
  description.mm_per_unit = number(content, "mm_per_unit", file);
  try {
    description.outputs.clear();
    for (const nlohmann::json& range :
         parse_json<nlohmann::json>(content.text("outputs", file), file + ": metadata 'outputs'"))
      description.outputs.push_back({range.at("name"), range.at("low"), range.at("high"), range.at("logarithmic")});
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file + ": metadata 'outputs' does not say the ranges of the outputs: " + error.what());
  }
  if (content.metadata.count("exposure")) {
    if (content.text("exposure", file) != "unknown")
      throw InputError(file + ": metadata 'exposure' is '" + content.text("exposure", file) +
                       "', where 'unknown' or none is expected");
    description.exposure = true;
  }
  if (content.metadata.count("limit")) description.limit = number(content, "limit", file);
  if (content.metadata.count("cut_out")) description.cut_out = number(content, "cut_out", file);
  try {
    if (content.metadata.count("inputs"))
      description.inputs = parse_json<nlohmann::json>(content.text("inputs", file), file + ": metadata 'inputs'")
                               .get<std::vector<std::string>>();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file + ": metadata 'inputs' is no list of names: " + error.what());
  }
  if (content.metadata.count("distribution")) read_distribution(content, file, description);
  return description;
}

void read_tensor(const Safetensors& content, const std::string& prefix, Tensor& to, const std::string& file) {
  const Tensor& from = content.tensor(prefix + to.name, file);
  if (from.shape != to.shape)
    throw InputError(file + ": array '" + from.name + "' is " + shape_text(from.shape) + ", where " +
                     shape_text(to.shape) + " is expected");
  to.values = from.values;
}

void write_network(const std::string& file, const Network& network, Precision precision) {
  std::vector<Tensor> weights = network.weights();
  if (precision != Precision::single)
    for (Tensor& weight : weights)
      if (sees_one_pixel(weight, network.description())) weight = centers(weight);
  write_file(file, safetensors_bytes({weights, network_metadata(network.description())}, precision));
}

Network parse_network(std::string_view bytes, const std::string& file) {
  const Safetensors content = parse_safetensors(bytes, file);
  const NetworkDescription description = network_description(content, file);
  try {
    // A small file must not ask for a large network's memory. Of a kernel's nine numbers it may hold one.
    std::size_t values = 0;
    for (const Tensor& tensor : content.tensors) values += tensor.values.size();
    const std::size_t needed = weight_count(description);
    if (values < needed / 9)
      throw InputError(file + ": has " + std::to_string(values) + " numbers, where its network has " +
                       std::to_string(needed) + "; copy the whole file");
    Network network(description);
    if (content.tensors.size() != network.weights().size())
      throw InputError(file + ": has " + std::to_string(content.tensors.size()) + " arrays, where " +
                       std::to_string(network.weights().size()) + " are expected");
    for (Tensor& weight : network.weights()) {
      if (sees_one_pixel(weight, description) && content.tensor(weight.name, file).shape == center_shape(weight))
        set_centers(content.tensor(weight.name, file), weight);
      else
        read_tensor(content, "", weight, file);
    }
    return network;
  } catch (const UsageError& error) {
    throw InputError(file + ": " + error.what());
  }
}

Network read_network(const std::string& file) { return parse_network(read_file(file), file); }

}  // namespace itn
