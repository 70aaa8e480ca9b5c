#include "tools/invert_posterior.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "runtime/base/error.h"
#include "runtime/base/seconds_since.h"
#include "runtime/inversion/posterior/posterior_outcome.h"
#include "tools/named_numbers.h"
#include "tools/progress.h"

namespace itn::tools {
namespace {

std::vector<NaturalRange> ranges_of(const PosteriorQuestion& question, const std::vector<Coordinate>& coordinates) {
  std::vector<NaturalRange> ranges;
  for (std::size_t p = 0; p < coordinates.size(); ++p) {
    const Coordinate& c = coordinates[p];
    std::vector<double> given;
    for (const std::string& text : question.ranges) {
      const NamedNumbers range = named_numbers(text);
      if (range.name == c.parameter().name) given = range.numbers;
    }
    const auto k = static_cast<Eigen::Index>(p);
    const double precision = question.prior.mean.empty() ? 0 : question.prior.precision(k, k);
    const bool known = precision > 0;
    if (known && !given.empty())
      throw UsageError(fmt::format("{}: --range and --prior; need one of them", c.parameter().name));
    ranges.push_back(known            ? NaturalRange::of_prior(c, question.prior.mean[p], precision)
                     : !given.empty() ? NaturalRange(c.parameter(), given[0], given[1])
                                      : NaturalRange::of_scene(c.parameter()));
  }
  for (const std::string& text : question.ranges) {
    const std::string name = named_numbers(text).name;
    if (std::none_of(coordinates.begin(), coordinates.end(),
                     [&](const Coordinate& c) { return c.parameter().name == name; }))
      throw UsageError(fmt::format("--range {}: need NAME=LOW,HIGH with a name given to --parameter", text));
  }
  return ranges;
}

void print_round(std::size_t number, const PosteriorRound& round, const std::vector<NaturalRange>& ranges) {
  std::string values;
  for (std::size_t p = 0; p < ranges.size(); ++p) {
    const auto i = static_cast<Eigen::Index>(p);
    const double low = std::max(-1.0, round.mean[i] - round.deviation[i]),
                 high = std::min(1.0, round.mean[i] + round.deviation[i]);
    values +=
        fmt::format("  {} {:.4g} to {:.4g}", ranges[p].parameter().name, ranges[p].value(low), ranges[p].value(high));
  }
  fmt::print("round {}  {} renderings{}  emulator {:.0f} %\n", number, round.exemplars, values,
             100 * round.emulator_share);
  std::fflush(stdout);
}

void print(const PosteriorOutcome& outcome, const std::vector<Coordinate>& coordinates) {
  for (const std::string& sentence : verdict(outcome)) fmt::print("{}\n", sentence);
  for (const auto* list : {&outcome.parameters, &outcome.coefficients, &outcome.exposures})
    for (const Interval& i : *list)
      fmt::print("{:<24} {:>10.5g}   95 %: {:.5g} to {:.5g}\n", i.name, i.value, i.low, i.high);
  for (const std::string& sentence : ambiguity_words(outcome, coordinates)) fmt::print("{}\n", sentence);
  fmt::print("{}/report.html: {:.1f} s\n", outcome.question.folder, outcome.seconds);
}

}  // namespace

void invert_posterior(const PosteriorQuestion& question, const Scene& scene, const std::vector<TargetImage>& targets,
                      ForwardModel& model, const StoredRun::Json& scene_request, const StoredRun::Json& request) {
  const CommonOptions& common = question.common;
  const auto seconds = [start = std::chrono::steady_clock::now()] { return seconds_since(start); };
  const std::vector<NaturalRange> ranges = ranges_of(question, model.coordinates());
  check_outputs(common, {});
  RenderingStore store(question.renderings, scene_request, question.parameters.size());
  StoredPosterior stored(question.asked.folder, request, store, model, ranges, targets, question.posterior);
  Progress progress(question.asked.scene, question.posterior.rounds, "rounds at most", !common.quiet);
  while (!stored.done()) {
    const std::size_t rounds = stored.posterior().rounds().size();
    stored.advance();
    if (stored.posterior().rounds().size() > rounds) {
      progress.clear();
      if (common.talkative()) print_round(rounds, stored.posterior().rounds().back(), ranges);
    }
    progress.update(stored.fraction());
  }
  progress.clear();
  PosteriorOutcome outcome = conclude(question.asked, stored, model, ranges, scene, targets, question.posterior);
  outcome.seconds = seconds();
  write_posterior(outcome, model.coordinates(), targets);
  if (common.talkative()) print(outcome, model.coordinates());
  write_json(common, to_json(outcome, model.coordinates()));
}

}  // namespace itn::tools
