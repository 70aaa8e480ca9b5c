// Trainer's checkpoints: a safetensors file of weights, optimizer and best weights; the rest as text in the metadata.
#include <cstdint>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/network_file.h"
#include "itn/safetensors.h"
#include "network/training/trainer.h"
#include "runtime/base/fingerprint.h"
#include "runtime/base/json_text.h"

namespace itn {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* FORMAT = "itn.checkpoint";
constexpr const char* VERSION = "1";

Json to_json(const EpochLosses& losses) { return {losses.supervised, losses.image, losses.validation}; }
EpochLosses losses_of(const Json& json) { return {json.at(0), json.at(1), json.at(2)}; }

void add(Safetensors& content, const std::string& prefix, const std::vector<Tensor>& tensors) {
  for (const Tensor& tensor : tensors) content.tensors.push_back({prefix + tensor.name, tensor.shape, tensor.values});
}

// Checksum over all numbers and the progress: a bit that has changed since would go on unseen.
std::string checksum(const Safetensors& content, const std::string& progress) {
  std::uint64_t sum = fingerprint(progress);
  for (const Tensor& tensor : content.tensors)
    sum = fingerprint({reinterpret_cast<const char*>(tensor.values.data()), tensor.values.size() * sizeof(float)}, sum);
  return fingerprint_text(sum);
}

void read(const Safetensors& content, const std::string& prefix, std::vector<Tensor>& tensors,
          const std::string& file) {
  for (Tensor& tensor : tensors) read_tensor(content, prefix, tensor, file);
}

}  // namespace

// All that must be the same for training to go on with the same numbers.
std::map<std::string, std::string> Trainer::circumstances() const {
  std::map<std::string, std::string> all = network_metadata(network_.description());
  all["format"] = FORMAT;
  all["version"] = VERSION;
  const auto number = [](double value) { return Json(value).dump(); };
  all["epochs"] = std::to_string(options_.epochs);
  all["batch"] = std::to_string(options_.batch);
  all["first_learning_rate"] = number(options_.first_learning_rate);
  all["last_learning_rate"] = number(options_.last_learning_rate);
  all["seed"] = std::to_string(options_.seed);
  all["image_weight"] = number(options_.image_weight);
  all["weight_decay"] = number(options_.weight_decay);
  if (options_.shards > 1) all["shards"] = std::to_string(options_.shards);
  if (options_.validated_by_images) all["validated_by_images"] = "true";
  all["patience"] = std::to_string(options_.patience);
  all["data"] = options_.data;
  all["training_examples"] = std::to_string(training_.count());
  all["validation_examples"] = std::to_string(validation_.count());
  return all;
}

void Trainer::write_checkpoint(const std::string& file) const {
  Safetensors content;
  content.metadata = circumstances();
  Json curve = Json::array();
  for (const EpochLosses& losses : curve_) curve.push_back(to_json(losses));
  content.metadata["progress"] =
      Json{{"steps", steps()}, {"sums", to_json(sums_)}, {"curve", curve}, {"best_epoch", best_epoch_}}.dump();
  add(content, "network.", network_.weights());
  add(content, "adam.mean.", adam_.state().mean);
  add(content, "adam.mean_square.", adam_.state().mean_square);
  add(content, "best.", best_weights_);
  content.metadata["checksum"] = checksum(content, content.metadata["progress"]);
  write_file(file, safetensors_bytes(content, Precision::single));
}

void Trainer::read_checkpoint(const std::string& file) {
  const Safetensors content = parse_safetensors(read_file(file), file);
  for (const std::string name : {"format", "version"})
    if (content.text(name, file) != circumstances().at(name))
      throw InputError(file + ": its " + name + " is '" + content.text(name, file) + "', where '" +
                       circumstances().at(name) + "' is expected");
  for (const auto& [name, value] : circumstances())
    if (content.text(name, file) != value)
      throw InputError(file + ": was made with " + name + " '" + content.text(name, file) + "', and now it is '" +
                       value + "'; go on with the same, or start anew in another folder");

  // Everything is read before anything changes.
  std::vector<Tensor> weights = network_.weights(), best;
  Adam::State state = adam_.state();
  read(content, "network.", weights, file);
  read(content, "adam.mean.", state.mean, file);
  read(content, "adam.mean_square.", state.mean_square, file);
  std::vector<EpochLosses> curve;
  EpochLosses sums;
  std::size_t best_epoch = 0;
  try {
    const auto progress = parse_json<Json>(content.text("progress", file), file + ": metadata 'progress'");
    state.steps = whole<std::uint64_t>(progress.at("steps"));
    sums = losses_of(progress.at("sums"));
    for (const Json& losses : progress.at("curve")) curve.push_back(losses_of(losses));
    best_epoch = whole<std::size_t>(progress.at("best_epoch"));
  } catch (const Json::exception& error) {
    throw InputError(file + ": metadata 'progress' does not say how far training was: " + error.what());
  }
  if (curve.size() != state.steps / steps_in_epoch() || (curve.empty() ? best_epoch != 0 : best_epoch >= curve.size()))
    throw InputError(file + ": metadata 'progress' contradicts itself");
  if (content.text("checksum", file) != checksum(content, content.text("progress", file)))
    throw InputError(file + ": has changed since it was written: its checksum differs; remove it to begin anew");
  if (!curve.empty()) {
    best = weights;
    read(content, "best.", best, file);
  }

  network_.weights() = std::move(weights);
  adam_.state() = std::move(state);
  best_weights_ = std::move(best);
  curve_ = std::move(curve);
  sums_ = sums;
  best_epoch_ = best_epoch;
  order_.clear();
}

}  // namespace itn
