#include "network/training/judge.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "itn/error.h"
#include "itn/loss.h"
#include "network/model/random.h"

namespace itn {
namespace {

// Examples themselves have no truth that a judge knows.
NetworkDescription without_outputs(NetworkDescription judge) {
  judge.outputs.clear();
  return judge;
}

}  // namespace

std::vector<OutputRange> outputs_of_judge(const NetworkDescription& network) {
  std::vector<OutputRange> outputs{{"doubt", 0, 1, false}};
  for (const Fault& fault : faults_of(network)) outputs.push_back({fault.name, 0, 1, false});
  return outputs;
}

JudgedExamples::JudgedExamples(const DatasetImages& images, const NetworkDescription& judge,
                               const DatasetExamples::Variation& variation, std::size_t times,
                               std::optional<std::uint64_t> hard_looks)
    : judge_(judge),
      faults_(faults_of(judge)),
      seed_(variation.seed),
      first_looks_(hard_looks.value_or(0)),
      times_(times),
      right_(images, without_outputs(judge), variation) {
  if (judge.outputs != outputs_of_judge(judge))
    throw UsageError("judge: its outputs are not those of what goes wrong with such photos; train it again");
  const bool knows_shape = Needs(judge).shape;
  for (std::size_t f = 0; f < faults_.size(); ++f) {
    const int hard = knows_shape ? faults_[f].often_of_known : faults_[f].often_of_unknown;
    const auto often = static_cast<std::size_t>(hard_looks ? hard : 1);
    later_.insert(later_.end(), often, f);
    if (often > 1) first_.insert(first_.end(), often, f);
  }
  if (first_.empty()) first_ = later_;
}

void JudgedExamples::read(std::size_t index, std::uint64_t look, std::span<float> image,
                          std::span<double> truth) const {
  const std::size_t original = index % right_.count();
  Photographs seen = right_.photographs(original, look);
  std::fill(truth.begin(), truth.end(), 0.0);
  if (index >= right_.count()) {
    const std::uint64_t stream = RANDOM_FAULT + look * count() + index;
    const std::vector<std::size_t>& drawn = look < first_looks_ ? first_ : later_;
    const std::size_t chosen = drawn[random_bits(seed_, stream, 0) % drawn.size()];
    const auto others = [&] {
      return right_.photographs(right_.of_another_shape(original, random_bits(seed_, stream, 1)), look);
    };
    spoil(seen, faults_[chosen], others, seed_, RANDOM_FLASH + stream);
    truth[0] = truth[1 + chosen] = 1;
  }
  if (judge_.cut_out > 0)
    keep_object(seen, cut_out(std::move(seen.shape.mask), seen.size, seen.size, seen.size, judge_.cut_out, "data set"));
  network_input(judge_, seen.seen(), image);
  if (original >= right_.originals()) mirror_input(judge_, image);
}

double judge_limit(const Predictions& examples) {
  std::vector<double> right;
  for (std::size_t i = 0; i < examples.truth.size(); i += examples.outputs)
    if (examples.truth[i] == 0) right.push_back(examples.predicted[i]);
  const auto rank = static_cast<std::size_t>(std::ceil(0.95 * static_cast<double>(right.size() + 1)));  // from 1
  if (rank > right.size()) return 1;
  std::nth_element(right.begin(), right.begin() + static_cast<std::ptrdiff_t>(rank - 1), right.end());
  return right[rank - 1];
}

JudgeErrors judge_errors(const Predictions& examples, double limit) {
  // Of the examples whose truth of this output is that.
  const auto share_above = [&](std::size_t output, double truth) {
    double all = 0, above = 0;
    for (std::size_t i = 0; i < examples.truth.size(); i += examples.outputs) {
      if (examples.truth[i + output] != truth) continue;
      all += 1;
      above += examples.predicted[i] > limit;
    }
    return all > 0 ? above / all : 0;
  };
  JudgeErrors result{limit, share_above(0, 0), {}};
  for (std::size_t f = 1; f < examples.outputs; ++f) result.found.push_back(share_above(f, 1));
  return result;
}

Verdict verdict_of(std::span<const float> raw, const NetworkDescription& judge) {
  const double doubt = parameters_of(raw, judge).front();
  return {doubt, doubt > judge.limit};
}

void require_judge_of(const NetworkDescription& network, const NetworkDescription& judge, const std::string& name) {
  if (!is_judge(judge))
    throw UsageError(fmt::format("--judge {}: is no judge; itn train DATA --network judge makes one", name));
  if (inputs_of(network) != inputs_of(judge) || network.exposure != judge.exposure ||
      (network.cut_out > 0) != (judge.cut_out > 0))
    throw UsageError(fmt::format(
        "--judge {}: sees {}, the network {}, or either has another view of exposures or of the object; train it with "
        "the same --inputs, --channels, --exposure and --cut-out",
        name, fmt::join(inputs_of(judge), ", "), fmt::join(inputs_of(network), ", ")));
}

}  // namespace itn
