#include "runtime/inverse/gauss_newton/inversion_outcome.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace itn {
namespace {

const std::string standard_error = "standard error";

constexpr double on_the_way = 2;  // standard errors: a start that comes so near an earlier one's end is bound for it
constexpr double same_place = 2;  // standard errors of both, which have the noise of the targets in common
constexpr double as_likely = 6;   // twice the log of a ratio of likelihoods that decides nothing
constexpr std::size_t enough_same = 3;  // starts that end in one place: it is where the scene is nearest to the image

bool gauss_newton(const InversionOutcome& outcome) { return outcome.question.method == "gauss-newton"; }

// Root mean square distance of the parameters from an end, in that end's standard errors.
double distance(const std::vector<double>& x, const Inversion::Conclusion& end, std::size_t parameters) {
  double sum = 0;
  for (std::size_t p = 0; p < parameters; ++p) {
    const auto k = static_cast<Eigen::Index>(p);
    sum += (x[p] - end.x[p]) * (x[p] - end.x[p]) / end.covariance(k, k);
  }
  return std::sqrt(sum / static_cast<double>(parameters));
}

bool same_end(const Inversion::Conclusion& a, const Inversion::Conclusion& b) {
  for (std::size_t p = 0; p < a.x.size(); ++p) {
    const auto k = static_cast<Eigen::Index>(p);
    if (!(std::fabs(a.x[p] - b.x[p]) <= same_place * std::sqrt(a.covariance(k, k) + b.covariance(k, k)))) return false;
  }
  return true;
}

// Sum of squared residuals of `a` less that of `b`, and its standard error.
struct Excess {
  double value = 0, error = 0;
  // Is `a` as good?
  bool undecided() const { return value <= std::max(as_likely, 2 * error); }
};

Excess excess(const Inversion::Conclusion& a, const Inversion::Conclusion& b) {
  double sum = 0, square = 0, count = 0;
  for (std::size_t t = 0; t < a.white.size(); ++t)
    for (std::size_t i = 0; i < a.white[t].value.size(); ++i) {
      const double x = a.white[t].value[i], y = b.white[t].value[i], d = x * x - y * y;
      sum += d;
      square += d * d;
      ++count;
    }
  return {sum, std::sqrt(std::max(0.0, square - sum * sum / std::max(1.0, count)))};
}

// As good as the noise of pixels can tell, and without a pattern that `best` does not leave: neighbouring pixels
// together tell what is far below the noise of one.
bool as_good(const Inversion::Conclusion& a, const Inversion::Conclusion& best) {
  return excess(a, best).undecided() && (a.fit.looks_alike() || !best.fit.looks_alike());
}

// Prefers, among two that fit equally well, the one that has converged, else the one that leaves no pattern.
bool preferred(const Inversion::Conclusion& a, const Inversion::Conclusion& b) {
  return a.converged != b.converged ? a.converged : a.fit.looks_alike() && !b.fit.looks_alike();
}

bool better(const Inversion::Conclusion& a, const Inversion::Conclusion& b) {
  if (preferred(a, b)) return excess(a, b).undecided();
  if (preferred(b, a)) return !excess(b, a).undecided();
  return excess(a, b).value < 0;
}

// Residuals are compared in units of the noise. It contains the rendering's own, so each run has its own unit.
InversionRun run_of(Inversion& inversion, const std::vector<Coordinate>& coordinates, const StartedInversion& started,
                    const std::vector<InversionRun>& before) {
  std::vector<double> values;
  for (std::size_t p = 0; p < coordinates.size(); ++p) values.push_back(coordinates[p].value(started.start[p]));
  const int joined = started.state.joined;
  return {values, started.steps,
          joined >= 0 ? before[static_cast<std::size_t>(joined)].end : inversion.conclude(started.state), joined};
}

}  // namespace

Agreement agreement(const std::vector<InversionRun>& runs) {
  Agreement result;
  result.count = runs.size();
  for (std::size_t k = 1; k < runs.size(); ++k) {
    if (better(runs[k].end, runs[result.best].end)) result.best = k;
  }
  const Inversion::Conclusion& best = runs[result.best].end;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Inversion::Conclusion& end = runs[k].end;
    if (k == result.best || (end.converged && same_end(end, best))) {
      ++result.same;
      continue;
    }
    const bool new_group = std::none_of(result.rivals.begin(), result.rivals.end(),
                                        [&](std::size_t r) { return same_end(runs[r].end, end); });
    if (end.converged && new_group && as_good(end, best)) result.rivals.push_back(k);
  }
  return result;
}

bool Agreement::sure(const Inversion::Conclusion& best_end) const {
  if (!rivals.empty()) return true;
  if (count < least_starts) return false;
  return !best_end.converged || same >= enough_same || (same > 1 && best_end.fit.looks_alike());
}

bool InversionOutcome::converged() const {
  const Inversion::Conclusion& end = found().end;
  return end.converged && end.fit.fits() && agreement.rivals.empty();
}

InversionOutcome invert(const InversionQuestion& question, Inversion& inversion,
                        const std::vector<Coordinate>& coordinates, Scene scene, StoredInversion& stored,
                        bool until_sure, const std::function<void(const InversionStep&)>& on_step) {
  InversionOutcome outcome;
  outcome.question = question;
  std::vector<InversionRun>& runs = outcome.runs;
  const auto conclude_until = [&](std::size_t count) {
    while (runs.size() < count) runs.push_back(run_of(inversion, coordinates, stored.started()[runs.size()], runs));
  };
  bool more = true;
  while (more) {
    while (!stored.finished()) {
      on_step(stored.advance());
      if (!gauss_newton(outcome)) continue;
      conclude_until(stored.current());
      const StartedInversion& current = stored.started().back();
      for (std::size_t k = 0; k < runs.size() && !current.state.done && current.steps.back().accepted; ++k)
        if (runs[k].end.converged && distance(current.state.x, runs[k].end, coordinates.size()) <= on_the_way)
          stored.join(k);
    }
    conclude_until(stored.started().size());
    if (gauss_newton(outcome)) {
      outcome.agreement = agreement(runs);
    } else {
      for (std::size_t k = 1; k < runs.size(); ++k)
        if (runs[k].end.loss < outcome.found().end.loss) outcome.agreement.best = k;
    }
    more = until_sure && gauss_newton(outcome) && !outcome.agreement.sure(outcome.found().end) && stored.another();
  }
  const Inversion::Conclusion& end = outcome.found().end;
  for (std::size_t p = 0; p < coordinates.size(); ++p)
    set_parameter(scene, coordinates[p].parameter(), coordinates[p].value(end.x[p]));
  outcome.parameters = intervals(coordinates, end.x, end.covariance);
  outcome.coefficients = transport_coefficients(scene, coordinates, end.x, end.covariance);
  outcome.directions = ambiguity(coordinates, end.x, end.covariance);
  outcome.exposures = exposures(coordinates, end.x, end.covariance, inversion.names());
  for (auto* list : {&outcome.parameters, &outcome.coefficients, &outcome.exposures})
    for (Interval& i : *list) i.holds = outcome.converged();
  for (std::size_t p = 0; p < coordinates.size(); ++p)
    if (coordinates[p].at_edge(end.x[p])) outcome.parameters[p].holds = false;
  return outcome;
}

nlohmann::ordered_json to_json(const InversionStep& step, const std::vector<Coordinate>& coordinates) {
  nlohmann::ordered_json values = nlohmann::ordered_json::object();
  for (std::size_t p = 0; p < coordinates.size(); ++p)
    values[coordinates[p].parameter().name] = coordinates[p].value(step.x[p]);
  return {
      {"iteration", step.iteration},     {"spp", step.spp},           {"parameters", values},     {"loss", step.loss},
      {"loss_stderr", step.loss_stderr}, {"accepted", step.accepted}, {"distance", step.distance}};
}

nlohmann::ordered_json to_json(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates) {
  nlohmann::ordered_json starts = nlohmann::ordered_json::array();
  for (const InversionRun& run : outcome.runs) {
    nlohmann::ordered_json from = nlohmann::ordered_json::object(), to = from;
    for (std::size_t p = 0; p < coordinates.size(); ++p) {
      from[coordinates[p].parameter().name] = run.start[p];
      to[coordinates[p].parameter().name] = coordinates[p].value(run.end.x[p]);
    }
    starts.push_back({{"from", from},
                      {"to", to},
                      {"loss", run.end.loss},
                      {"iterations", run.steps.size()},
                      {"converged", run.end.converged},
                      {"fits", run.end.fit.fits()}});
  }
  const Inversion::Conclusion& end = outcome.found().end;
  return {{"schema", "itn.invert/1"},
          {"scene", outcome.question.scene},
          {"method", outcome.question.method},
          {"converged", outcome.converged()},
          {"fit", to_json(end.fit)},
          {"misfit", to_json(outcome.misfit)},
          {"parameters", to_json(outcome.parameters)},
          {"coefficients", to_json(outcome.coefficients)},
          {"exposures", to_json(outcome.exposures)},
          {"prior", outcome.question.prior},
          {"ambiguity", to_json(outcome.directions, coordinates, standard_error)},
          {"loss", end.loss},
          {"loss_stderr", end.loss_stderr},
          {"residual", end.residual},
          {"distance", end.distance},
          {"iterations", outcome.found().steps.size()},
          {"starts", starts},
          {"verdict", verdict(outcome, coordinates)},
          {"time", {{"total_s", outcome.seconds}}}};
}

std::vector<std::string> verdict(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates) {
  const Inversion::Conclusion& end = outcome.found().end;
  std::vector<std::string> text;
  const Agreement& agreement = outcome.agreement;
  const std::size_t iterations = outcome.found().steps.size();
  if (outcome.converged())
    text.push_back(fmt::format("Converged after {} iterations.", iterations));
  else if (end.converged && !end.fit.fits())
    text.push_back(
        fmt::format("NOT converged: it has settled after {} iterations, but the image found does not fit: "
                    "the intervals do not hold.",
                    iterations));
  else if (!end.determined)
    text.push_back(fmt::format("NOT converged after {} iterations.", iterations));
  else if (!end.converged)
    text.push_back(
        fmt::format("NOT converged after {} iterations: the least-squares solution is about {:.1f} standard errors "
                    "away; the intervals do not hold. Give it more iterations, or start nearer.",
                    iterations, end.distance));
  else
    text.push_back(
        fmt::format("NOT converged: the images fit {} separate materials as well as the noise can tell, and the "
                    "intervals are those of one of them. Method posterior shows all that fits.",
                    1 + agreement.rivals.size()));
  for (const std::size_t k : agreement.rivals) {
    std::vector<std::string> values;
    for (std::size_t p = 0; p < coordinates.size(); ++p)
      values.push_back(
          fmt::format("{} {:.5g}", coordinates[p].parameter().name, coordinates[p].value(outcome.runs[k].end.x[p])));
    text.push_back(fmt::format("The image fits as well with {}.", fmt::join(values, ", ")));
  }
  if (!end.determined)
    text.emplace_back(
        "A direction of the parameters shows so little in the images that the noise of the derivatives hides it: the "
        "intervals do not hold. Give it more samples (spp), fewer parameters, or what is known of them beforehand "
        "(prior).");
  else if (end.hidden)
    text.emplace_back(
        "A direction of the parameters shows so little in the images that the noise of the derivatives hides it: along "
        "it the result is what was known before. More samples (spp) may tell more.");
  for (std::size_t p = 0; p < coordinates.size(); ++p)
    if (coordinates[p].at_edge(end.x[p]))
      text.push_back(fmt::format("{} ended on the edge of its range: its interval does not hold.",
                                 coordinates[p].parameter().name));
  if (!outcome.question.prior.empty())
    text.push_back(fmt::format("The result and its intervals count in what was known before (95 %): {}.",
                               fmt::join(outcome.question.prior, "; ")));
  if (!outcome.question.noise_known) text.push_back(measured_noise_words());
  if (!outcome.question.doubt.empty()) text.push_back("Of the start: " + outcome.question.doubt + ".");
  text.push_back(words(end.fit));
  if (!outcome.misfit.words.empty()) text.push_back(outcome.misfit.words);
  if (outcome.runs.size() > 1) {
    std::size_t same = agreement.same;
    if (!gauss_newton(outcome))
      same = static_cast<std::size_t>(std::count_if(outcome.runs.begin(), outcome.runs.end(), [&](const auto& run) {
        return run.end.converged && same_end(run.end, end);
      }));
    text.push_back(fmt::format("{} of {} starts end at the same parameters.", same, outcome.runs.size()));
    if (!end.fit.fits())
      text.emplace_back(same > 1 ? "Another start ends where this one does: it is not the start that is wrong."
                                 : "No other start ended there: more places to start from (starts, range) or method "
                                   "posterior may find a material that fits.");
  }
  return text;
}

std::vector<std::string> ambiguity_words(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates) {
  return ambiguity_words(outcome.directions, coordinates, standard_error);
}

std::vector<std::string> ambiguity_words(const std::vector<Direction>& directions,
                                         const std::vector<Coordinate>& coordinates, const std::string& deviation) {
  std::vector<std::string> text;
  text.reserve(directions.size());
  for (const Direction& direction : directions)
    text.push_back(fmt::format("known to {:.2g} % (one {}): {} together", 100 * direction.uncertainty, deviation,
                               words(direction, coordinates)));
  return text;
}

nlohmann::ordered_json to_json(const std::vector<Direction>& directions, const std::vector<Coordinate>& coordinates,
                               const std::string& deviation) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  const std::vector<std::string> texts = ambiguity_words(directions, coordinates, deviation);
  for (std::size_t k = 0; k < directions.size(); ++k) {
    nlohmann::ordered_json parts = nlohmann::ordered_json::object();
    for (std::size_t p = 0; p < coordinates.size(); ++p) parts[coordinates[p].parameter().name] = directions[k].part[p];
    json.push_back({{"direction", parts}, {"relative_uncertainty", directions[k].uncertainty}, {"words", texts[k]}});
  }
  return json;
}

nlohmann::ordered_json to_json(const std::vector<Interval>& intervals) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const Interval& i : intervals)
    json[i.name] = {{"value", i.value}, {"low", i.low}, {"high", i.high}, {"stderr", i.stderr_}, {"holds", i.holds}};
  return json;
}

std::string mark(const Interval& interval) { return interval.holds ? "" : " (does not hold)"; }

std::string failure(const InversionOutcome& outcome) {
  if (outcome.converged()) return "";
  const Inversion::Conclusion& end = outcome.found().end;
  if (!end.fit.fits()) return misfit_words({end.fit, outcome.misfit});
  if (!outcome.agreement.rivals.empty())
    return "separate materials fit as well, the intervals are those of one of them.";
  return "it has not settled, the intervals do not hold.";
}

}  // namespace itn
