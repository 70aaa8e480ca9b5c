#include "runtime/inverse/gauss_newton/numbers_inversion.h"

#include <fmt/format.h>

#include <algorithm>

#include "itn/error.h"
#include "runtime/base/seconds_since.h"
#include "runtime/inverse/gauss_newton/inversion_report.h"

namespace itn {
namespace {

constexpr std::size_t most_unknowns = 8;  // of a posterior that nobody asks for
constexpr double most_samples = 1 << 29;  // that a pixel has, over all iterations

bool is_adam(const NumbersQuestion& question) { return question.method == "adam"; }

// Has nobody named a method, and asked for nothing that the posterior does not have?
bool may_be_posterior(const NumbersQuestion& question) {
  return question.method.empty() && question.alone && !question.started && question.starts == 0 &&
         !question.white_balance;
}

InversionOptions inversion_options(const NumbersQuestion& question) {
  InversionOptions how;
  how.method = is_adam(question) ? InversionOptions::Method::adam : InversionOptions::Method::gauss_newton;
  how.iterations = question.iterations;
  how.spp = question.spp;
  how.noise = question.noise;
  how.learning_rate = question.learning_rate;
  how.exposure = question.exposure;
  how.white_balance = question.white_balance;
  return how;
}

PosteriorOptions posterior_options(const NumbersQuestion& question) {
  PosteriorOptions how;
  if (question.iterations > 0) how.rounds = question.iterations;
  how.spp = question.spp;
  how.seed = question.seed;
  how.noise = question.noise;
  how.exposure = question.exposure;
  return how;
}

Prior prior_of(const NamedIntervals& known, const std::vector<Coordinate>& coordinates) {
  Prior prior;
  for (const auto& [name, interval] : known) {
    const auto& [low, high] = interval;
    const std::string said = fmt::format("prior {}={},{}", name, low, high);
    const auto found = std::find_if(coordinates.begin(), coordinates.end(),
                                    [&, wanted = name](const Coordinate& c) { return c.parameter().name == wanted; });
    if (found == coordinates.end())
      throw UsageError(said + ": need NAME=LOW,HIGH with the name of a parameter that is asked for");
    const Parameter& parameter = found->parameter();
    if (!parameter.contains(low) || !parameter.contains(high) || !(low < high))
      throw UsageError(
          fmt::format("{}: need NAME=LOW,HIGH, two numbers in {}, the smaller first", said, parameter.range()));
    prior.add_interval(coordinates, static_cast<std::size_t>(found - coordinates.begin()), low, high);
  }
  return prior;
}

std::vector<std::string> words(const NamedIntervals& known) {
  std::vector<std::string> text;
  for (const auto& [name, interval] : known)
    text.push_back(fmt::format("{}={},{}", name, interval.first, interval.second));
  return text;
}

InversionQuestion for_reports(const NumbersQuestion& question, const std::string& method, const std::string& folder) {
  return {question.scene, method, folder, question.targets, words(question.prior), question.noise.known};
}

StoredRun::Json request_of(const NumbersQuestion& question, const std::string& method) {
  StoredRun::Json request = question.request;
  request["method"] = method;
  return request;
}

InversionOutcome find_values(const NumbersQuestion& question, const std::string& method, const NetworkPrior& network,
                             const Scene& scene, const std::vector<TargetImage>& targets, ForwardModel& model,
                             const NumbersWatch& watch) {
  const std::vector<Coordinate>& coordinates = model.coordinates();
  InversionQuestion words = for_reports(question, method, question.folder);
  InversionOptions how = inversion_options(question);
  words.doubt = network.doubt;
  how.prior = prior_of(question.prior, coordinates);
  const bool adam = is_adam(question);
  if (question.prior.empty() && !adam) {
    how.prior = network.prior;
    words.prior = network.words;
  }
  Inversion inversion(model, targets, how);
  const bool until_sure = question.starts == 0 && !adam;
  const int most = until_sure ? static_cast<int>(most_starts) : std::max(1, question.starts);
  StoredInversion stored(question.folder, request_of(question, method), inversion, coordinates,
                         inversion_starts(coordinates, model.start(), most, question.seed, question.range),
                         until_sure ? 1 : 0);
  InversionOutcome outcome =
      invert(words, inversion, coordinates, scene, stored, until_sure, [&](const InversionStep& step) {
        if (watch.on_step) watch.on_step(stored, step, how.iteration_limit());
      });
  const Inversion::Conclusion& end = outcome.found().end;
  std::vector<ComparedImage> compared;
  for (std::size_t t = 0; t < targets.size(); ++t)
    compared.push_back({end.images[t], end.factors[t], targets[t], end.white[t]});
  outcome.misfit = misfit_of(compared, end.fit, question.exposure, question.white_balance);
  outcome.seconds = seconds_since(question.begun);
  write_inversion(outcome, coordinates, targets);
  return outcome;
}

PosteriorOutcome find_posterior(const NumbersQuestion& question, const Scene& scene,
                                const std::vector<TargetImage>& targets, ForwardModel& model,
                                const NumbersWatch& watch) {
  const std::string& folder = question.folder;
  const std::vector<Coordinate>& coordinates = model.coordinates();
  const std::vector<NaturalRange> ranges =
      natural_ranges(coordinates, prior_of(question.prior, coordinates), question.range);
  RenderingStore store(question.renderings.empty() ? folder + "/renderings" : question.renderings, question.of_scene,
                       coordinates.size());
  const PosteriorOptions how = posterior_options(question);
  StoredPosterior stored(folder, request_of(question, "posterior"), store, model, ranges, targets, how);
  while (!stored.done()) {
    stored.advance();
    if (watch.on_rendering) watch.on_rendering(stored, ranges);
  }
  PosteriorOutcome outcome =
      conclude(for_reports(question, "posterior", folder), stored, model, ranges, scene, targets, how);
  outcome.seconds = seconds_since(question.begun);
  write_posterior(outcome, coordinates, targets);
  return outcome;
}

bool asks_for_posterior(const NumbersQuestion& question) {
  return !question.range.empty() || !question.renderings.empty();
}

// The method that the question names. Without one: the posterior for up to eight numbers, whose intervals hold more
// often and which needs no start, else Gauss-Newton. Throws UsageError: a range is wrong.
std::string method_of(const NumbersQuestion& question, const std::vector<Coordinate>& coordinates) {
  if (!question.method.empty()) return question.method;
  const bool asked_for = asks_for_posterior(question);
  if (!may_be_posterior(question) || (coordinates.size() > most_unknowns && !asked_for)) return "gauss-newton";
  try {
    natural_ranges(coordinates, prior_of(question.prior, coordinates), question.range);
  } catch (const UsageError&) {
    if (asked_for) throw;
    return "gauss-newton";  // no range for a posterior
  }
  return "posterior";
}

}  // namespace

bool NumbersAnswer::converged() const { return posterior ? posterior->converged() : inversion->converged(); }

const std::vector<Rendering>& NumbersAnswer::images() const {
  return posterior ? posterior->images : inversion->found().end.images;
}

const std::string& NumbersAnswer::folder() const {
  return posterior ? posterior->question.folder : inversion->question.folder;
}

void check(const NumbersQuestion& question, const std::vector<TargetImage>& targets) {
  if (question.method == "posterior") {
    if (question.started || question.starts > 0)
      throw UsageError("start, starts, init: mean nothing to method posterior, which needs no start");
    if (question.white_balance) throw UsageError("white balance: of method gauss-newton alone");
    if (question.spp == 1) throw UsageError("spp 1: a rendering has two halves; need 2 or more");
    return;
  }
  if (asks_for_posterior(question) && !may_be_posterior(question))
    throw UsageError(fmt::format(
        "range, renderings: mean nothing {}; they are the posterior's",
        question.method.empty() ? "with start, starts, init or white balance" : "to method " + question.method));
  if (is_adam(question) && !question.prior.empty())
    throw UsageError("prior: adam minimises the image loss alone; use method gauss-newton");
  if (question.white_balance && is_adam(question))
    throw UsageError("white balance: adam finds exposures alone; use method gauss-newton");
  if (question.white_balance &&
      std::any_of(targets.begin(), targets.end(), [](const TargetImage& t) { return t.channels == 1; }))
    throw UsageError("white balance: the sensor's film has luminance alone; need one with colours");
  const InversionOptions how = inversion_options(question);
  const int samples = how.sample_limit(targets);
  if (samples < 2) throw UsageError("spp 1: a loss compares different samples of a pixel; need 2 or more");
  if (double(how.iteration_limit()) * samples > most_samples)
    throw UsageError(fmt::format("{} iterations with {} samples a pixel: need at most {} samples in all",
                                 how.iteration_limit(), samples, most_samples));
}

NumbersAnswer invert_numbers(const NumbersQuestion& question, const NetworkPrior& network, const Scene& scene,
                             const std::vector<TargetImage>& targets, ForwardModel& model, const NumbersWatch& watch) {
  check(question, targets);
  const std::string method = method_of(question, model.coordinates());
  NumbersAnswer answer;
  if (method == "posterior")
    answer.posterior = find_posterior(question, scene, targets, model, watch);
  else
    answer.inversion = find_values(question, method, network, scene, targets, model, watch);
  return answer;
}

nlohmann::ordered_json to_json(const NumbersAnswer& answer, const std::vector<Coordinate>& coordinates) {
  return answer.posterior ? to_json(*answer.posterior, coordinates) : to_json(*answer.inversion, coordinates);
}

std::vector<std::string> verdict(const NumbersAnswer& answer, const std::vector<Coordinate>& coordinates) {
  return answer.posterior ? verdict(*answer.posterior) : verdict(*answer.inversion, coordinates);
}

std::string failure(const NumbersAnswer& answer) {
  return answer.posterior ? failure(*answer.posterior) : failure(*answer.inversion);
}

std::vector<std::string> ambiguity_words(const NumbersAnswer& answer, const std::vector<Coordinate>& coordinates) {
  return answer.posterior ? ambiguity_words(*answer.posterior, coordinates)
                          : ambiguity_words(*answer.inversion, coordinates);
}

}  // namespace itn
