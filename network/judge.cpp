#include "network/judge.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "network/loss.h"
#include "network/random.h"
#include "runtime/base/error.h"

namespace itn {
namespace {

// Examples themselves have no truth that a judge knows.
NetworkDescription without_outputs(NetworkDescription judge) {
  judge.outputs.clear();
  return judge;
}

}  // namespace

std::vector<OutputRange> outputs_of_judge(const NetworkDescription& network) {
  for (const char* known : {"normal", "nearness", "light"})
    if (sees(network, known))
      throw UsageError(fmt::format("--network judge: of photos, a flash and a mask; it cannot see '{}'", known));
  std::vector<OutputRange> outputs{{"doubt", 0, 1, false}};
  for (const Fault& fault : faults_of(network)) outputs.push_back({fault.name, 0, 1, false});
  return outputs;
}

JudgedExamples::JudgedExamples(const DatasetImages& images, const NetworkDescription& judge,
                               const DatasetExamples::Variation& variation, std::size_t times)
    : judge_(judge),
      faults_(faults_of(judge)),
      seed_(variation.seed),
      times_(times),
      right_(images, without_outputs(judge), variation) {
  if (judge.outputs != outputs_of_judge(judge))
    throw UsageError("judge: its outputs are not those of what goes wrong with such photos; train it again");
}

void JudgedExamples::read(std::size_t index, std::uint64_t look, std::span<float> image,
                          std::span<double> truth) const {
  const std::size_t original = index % right_.count();
  Photographs seen = right_.photographs(original, look);
  std::fill(truth.begin(), truth.end(), 0.0);
  if (index >= right_.count()) {
    const std::uint64_t stream = RANDOM_FAULT + look * count() + index;
    const auto chosen = static_cast<std::size_t>(random_bits(seed_, stream, 0) % faults_.size());
    const auto others_flash = [&] {
      const std::size_t others = std::max<std::size_t>(1, right_.originals() - 1);
      return right_.photographs((original + 1 + random_bits(seed_, stream, 1) % others) % right_.originals(), look)
          .flash;
    };
    spoil(seen, faults_[chosen], others_flash, seed_, RANDOM_FLASH + stream);
    truth[0] = truth[1 + chosen] = 1;
  }
  SeenShape shape{{}, {}, std::move(seen.mask)};
  if (judge_.cut_out > 0) {
    CutOut object = cut_out(std::move(shape.mask), seen.size, seen.size, seen.size, judge_.cut_out, "data set");
    seen.image = cut_planes(std::move(seen.image), object);
    if (!seen.flash.empty()) seen.flash = cut_planes(std::move(seen.flash), object);
    shape = std::move(object.mask);
  }
  network_input(judge_, {seen.image, seen.flash, &shape}, image);
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
  const auto unit = [](const NetworkDescription& n) { return n.exposure ? 0 : n.luminance; };
  if (inputs_of(network) != inputs_of(judge) || network.size != judge.size || network.exposure != judge.exposure ||
      std::fabs(network.cut_out - judge.cut_out) > 1e-6 || unit(network) != unit(judge))
    throw UsageError(fmt::format(
        "--judge {}: sees {} of {} pixels, the network {} of {}, or either has another view of exposures, of "
        "the object or of luminance; train it on the same data sets with the same --inputs, --exposure and "
        "--cut-out",
        name, fmt::join(inputs_of(judge), ", "), judge.size, fmt::join(inputs_of(network), ", "), network.size));
}

}  // namespace itn
