#include "runtime/inversion/inversion_outcome.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace itn {
namespace {

const std::string standard_error = "standard error";

}  // namespace

InversionOutcome conclude(const InversionQuestion& question, Inversion& inversion,
                          const std::vector<Coordinate>& coordinates, Scene scene,
                          const std::vector<StartedInversion>& started) {
  InversionOutcome outcome;
  outcome.question = question;
  for (const StartedInversion& run : started) {
    std::vector<double> values;
    for (std::size_t p = 0; p < coordinates.size(); ++p) values.push_back(coordinates[p].value(run.start[p]));
    outcome.runs.push_back({values, run.steps, inversion.conclude(run.state)});
    if (outcome.runs.back().end.loss < outcome.found().end.loss) outcome.best = outcome.runs.size() - 1;
  }
  const Inversion::Conclusion& end = outcome.found().end;
  for (std::size_t p = 0; p < coordinates.size(); ++p)
    set_parameter(scene, coordinates[p].parameter(), coordinates[p].value(end.x[p]));
  outcome.parameters = intervals(coordinates, end.x, end.covariance);
  outcome.coefficients = transport_coefficients(scene, coordinates, end.x, end.covariance);
  outcome.directions = ambiguity(coordinates, end.x, end.covariance);
  outcome.exposures = exposures(coordinates, end.x, end.covariance, inversion.names());
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
                      {"converged", run.end.converged}});
  }
  const Inversion::Conclusion& end = outcome.found().end;
  return {{"schema", "itn.invert/1"},
          {"scene", outcome.question.scene},
          {"method", outcome.question.method},
          {"converged", end.converged},
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
  text.push_back(
      end.converged ? fmt::format("Converged after {} iterations.", outcome.found().steps.size())
      : !end.determined
          ? fmt::format("NOT converged after {} iterations.", outcome.found().steps.size())
          : fmt::format("NOT converged after {} iterations: the least-squares solution is about {:.1f} standard errors "
                        "away; the intervals do not hold. Give it more iterations, or start nearer.",
                        outcome.found().steps.size(), end.distance));
  if (!end.determined)
    text.emplace_back(
        "A direction of the parameters shows so little in the images that the noise of the derivatives hides it: the "
        "intervals do not hold. Give it more samples (--spp), fewer parameters, or what is known of them beforehand "
        "(--prior).");
  else if (end.hidden)
    text.emplace_back(
        "A direction of the parameters shows so little in the images that the noise of the derivatives hides it: along "
        "it the result is what was known before. More samples (--spp) may tell more.");
  for (std::size_t p = 0; p < coordinates.size(); ++p)
    if (coordinates[p].at_edge(end.x[p]))
      text.push_back(fmt::format("{} ended on the edge of its range: its interval does not hold.",
                                 coordinates[p].parameter().name));
  if (!outcome.question.prior.empty())
    text.push_back(fmt::format("The result and its intervals count in what was known before (95 %): {}.",
                               fmt::join(outcome.question.prior, "; ")));
  const double chance = 1 + 5 * std::sqrt(2 / end.residuals);
  if (!outcome.question.noise_known)
    text.emplace_back(
        "The targets' noise is not known (no standard errors in the files, no --noise): 1 % of the radiance was "
        "assumed "
        "to weigh the pixels; the intervals come from what is left of the targets, so they hold if that is noise.");
  else if (end.residual > std::max(1.2, chance))
    text.push_back(fmt::format(
        "What is left of the targets has {:.3g} times the variance that their noise explains: shape, light, camera or "
        "noise are not those of the scene, and the parameters may be off by more than their intervals say.",
        end.residual));
  else
    text.push_back(
        fmt::format("What is left of the targets is their noise ({:.3g} times its variance).", end.residual));
  std::size_t same = 0;
  for (const InversionRun& run : outcome.runs) {
    bool near = run.end.converged;
    for (std::size_t p = 0; p < coordinates.size(); ++p) {
      const auto k = static_cast<Eigen::Index>(p);
      near &= std::fabs(run.end.x[p] - end.x[p]) <= 4 * std::sqrt(end.covariance(k, k) + run.end.covariance(k, k));
    }
    same += near;
  }
  if (outcome.runs.size() > 1)
    text.push_back(fmt::format("{} of {} starts end at the same parameters.", same, outcome.runs.size()));
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
    json[i.name] = {{"value", i.value}, {"low", i.low}, {"high", i.high}, {"stderr", i.stderr_}};
  return json;
}

}  // namespace itn
