#include "runtime/inverse/posterior/posterior_outcome.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "runtime/base/random.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

constexpr int concluding_spp = 256;

// Mean, standard deviation and the middle 95 % of the samples.
Interval interval_of(const std::string& name, std::vector<double> samples) {
  const auto count = static_cast<double>(samples.size());
  double mean = 0, square = 0;
  for (const double v : samples) mean += v / count;
  for (const double v : samples) square += (v - mean) * (v - mean) / count;
  std::sort(samples.begin(), samples.end());
  const auto quantile = [&](double p) {
    const double at = p * (count - 1);
    const auto below = static_cast<std::size_t>(at);
    const std::size_t above = std::min(samples.size() - 1, below + 1);
    return samples[below] + (at - std::floor(at)) * (samples[above] - samples[below]);
  };
  return {name, mean, quantile(0.025), quantile(0.975), std::sqrt(square)};
}

void add_exposures(const Posterior& posterior, const PosteriorOptions& options, std::size_t targets,
                   PosteriorOutcome& outcome) {
  const Samples& samples = posterior.samples();
  for (std::size_t t = 0; options.exposure && t < targets; ++t) {
    std::vector<double> values;
    for (Eigen::Index s = 0; s < samples.at.cols(); ++s) {
      const EmulatedView::Exposure e = posterior.exposure(t, samples.at.col(s));
      const double z = normal_quantile(random_uniform(options.seed, 77 + t, static_cast<std::uint64_t>(s)));
      values.push_back(e.mean + z * e.deviation);
    }
    outcome.names.push_back(fmt::format("exposure {}", t));
    outcome.exposures.push_back(interval_of(outcome.names.back(), values));
    outcome.samples.push_back(std::move(values));
  }
}

// Reduced scattering and absorption of every sample.
std::vector<Interval> coefficients_of(Scene& scene, const std::vector<Coordinate>& coordinates,
                                      const std::vector<std::vector<double>>& samples) {
  constexpr std::size_t most = 1000;
  const auto n = static_cast<Eigen::Index>(coordinates.size());
  const Eigen::MatrixXd nothing = Eigen::MatrixXd::Zero(n, n);
  std::vector<std::string> names;
  std::vector<std::vector<double>> values;
  const std::size_t count = samples[0].size();
  for (std::size_t s = 0; s < count; s += std::max<std::size_t>(1, count / most)) {
    std::vector<double> x;
    for (std::size_t p = 0; p < coordinates.size(); ++p) {
      set_parameter(scene, coordinates[p].parameter(), samples[p][s]);
      x.push_back(coordinates[p].of(samples[p][s]));
    }
    const std::vector<Interval> of_sample = transport_coefficients(scene, coordinates, x, nothing);
    values.resize(of_sample.size());
    names.resize(of_sample.size());
    for (std::size_t k = 0; k < of_sample.size(); ++k) {
      names[k] = of_sample[k].name;
      values[k].push_back(of_sample[k].value);
    }
  }
  std::vector<Interval> result;
  for (std::size_t k = 0; k < names.size(); ++k) result.push_back(interval_of(names[k], values[k]));
  return result;
}

Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& rows) {
  const Eigen::MatrixXd centred = rows.colwise() - Eigen::VectorXd(rows.rowwise().mean());
  return centred * centred.transpose() / static_cast<double>(rows.cols());
}

// Renders the likeliest sample: the means of a bent posterior, or of one with several peaks, need fit no image.
void compare(const std::vector<TargetImage>& targets, ForwardModel& model, const PosteriorOptions& options,
             std::size_t likeliest, PosteriorOutcome& outcome) {
  // Samples that no rendering of the scene has.
  constexpr int first = 1 << 28;
  const std::size_t parameters = model.coordinates().size();
  std::vector<double> values;
  for (std::size_t p = 0; p < parameters; ++p) values.push_back(outcome.samples[p][likeliest]);
  std::vector<LossGradient> losses;
  std::vector<std::vector<Rendering>> groups(targets.size());
  for (int g = 0; g < 4; ++g) {
    const std::vector<Rendering> images =
        model.render_values(values, first + g * concluding_spp / 4, concluding_spp / 4);
    for (std::size_t t = 0; t < targets.size(); ++t) groups[t].push_back(images[t]);
  }
  // The noise, of samples of its own.
  const std::vector<Rendering> others = model.render_values(values, first + concluding_spp, concluding_spp);
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const double exposure = outcome.exposures.empty() ? 1 : outcome.samples[parameters + t][likeliest];
    losses.push_back(loss_gradient(groups[t], targets[t], exposure));
    Rendering mean = groups[t][0];
    for (std::size_t i = 0; i < mean.mean.size(); ++i) {
      float sum = 0, square = 0;
      for (const Rendering& g : groups[t]) {
        sum += g.mean[i] / 4;
        square += g.stderr_[i] * g.stderr_[i] / 16;
      }
      mean.mean[i] = sum;
      mean.stderr_[i] = std::sqrt(square);
    }
    mean.spp = concluding_spp;
    const std::array<double, 3> factors{exposure, exposure, exposure};
    outcome.white.push_back(
        white_residual(mean, targets[t], factors, noise_of(others[t], targets[t], factors, options.noise.relative)));
    for (std::size_t i = 0; i < mean.mean.size(); ++i) {
      mean.mean[i] *= static_cast<float>(exposure);
      mean.stderr_[i] *= static_cast<float>(exposure);
    }
    outcome.images.push_back(std::move(mean));
  }
  outcome.fit = image_fit(outcome.white, outcome.question.noise_known);
  std::vector<ComparedImage> compared;
  for (std::size_t t = 0; t < targets.size(); ++t)
    compared.push_back({outcome.images[t], {1, 1, 1}, targets[t], outcome.white[t]});
  outcome.misfit = misfit_of(compared, outcome.fit, options.exposure, false);
  const LossGradient loss = mean_of(losses);
  outcome.loss = loss.loss;
  outcome.loss_stderr = loss.loss_stderr;
}

const std::string standard_deviation = "standard deviation";

}  // namespace

PosteriorOutcome conclude(const InversionQuestion& question, const StoredPosterior& stored, ForwardModel& model,
                          const std::vector<NaturalRange>& ranges, Scene scene, const std::vector<TargetImage>& targets,
                          const PosteriorOptions& options) {
  const Posterior& posterior = stored.posterior();
  const Samples& samples = posterior.samples();
  PosteriorOutcome outcome;
  outcome.question = question;
  outcome.rounds = posterior.rounds();
  outcome.ranges = ranges;
  outcome.found = stored.found();
  outcome.made = stored.made();
  outcome.residual = outcome.rounds.back().residual;
  const std::vector<Coordinate>& coordinates = model.coordinates();
  const Eigen::Index count = samples.at.cols();
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(ranges.size()), count), values(rows.rows(), count);
  for (std::size_t p = 0; p < ranges.size(); ++p) {
    const auto r = static_cast<Eigen::Index>(p);
    std::vector<double> of_parameter;
    for (Eigen::Index s = 0; s < count; ++s) {
      of_parameter.push_back(ranges[p].value(samples.at(r, s)));
      values(r, s) = of_parameter.back();
      rows(r, s) = coordinates[p].of(of_parameter.back());
    }
    outcome.names.push_back(ranges[p].parameter().name);
    outcome.parameters.push_back(interval_of(outcome.names.back(), of_parameter));
    outcome.samples.push_back(std::move(of_parameter));
  }
  outcome.coefficients = coefficients_of(scene, coordinates, outcome.samples);
  add_exposures(posterior, options, targets.size(), outcome);
  for (Eigen::Index s = 0; s < count; ++s)
    outcome.log_density.push_back(samples.log_prior[s] + samples.log_likelihood[s]);

  const Eigen::MatrixXd covariance = covariance_of(values);
  const Eigen::VectorXd deviation = covariance.diagonal().cwiseSqrt().cwiseMax(1e-300);
  outcome.correlation = deviation.cwiseInverse().asDiagonal() * covariance * deviation.cwiseInverse().asDiagonal();
  const Eigen::VectorXd mean = rows.rowwise().mean();
  outcome.directions = ambiguity(coordinates, {mean.begin(), mean.end()}, covariance_of(rows));

  outcome.peak_of.assign(static_cast<std::size_t>(count), -1);
  for (std::size_t k = 0; k < posterior.peaks().size(); ++k) {
    const Peak& peak = posterior.peaks()[k];
    PosteriorOutcome::PeakValues of_peak{peak.share, {}};
    for (const Eigen::Index s : peak.samples) outcome.peak_of[static_cast<std::size_t>(s)] = static_cast<int>(k);
    for (std::size_t p = 0; p < ranges.size(); ++p) {
      std::vector<double> of_parameter;
      for (const Eigen::Index s : peak.samples) of_parameter.push_back(outcome.samples[p][static_cast<std::size_t>(s)]);
      of_peak.parameters.push_back(interval_of(outcome.names[p], of_parameter));
    }
    outcome.peaks.push_back(std::move(of_peak));
  }
  Eigen::Index likeliest = 0;
  samples.log_likelihood.maxCoeff(&likeliest);
  compare(targets, model, options, static_cast<std::size_t>(likeliest), outcome);
  std::vector<std::vector<Interval>*> lists{&outcome.parameters, &outcome.coefficients, &outcome.exposures};
  for (PosteriorOutcome::PeakValues& peak : outcome.peaks) lists.push_back(&peak.parameters);
  for (auto* list : lists)
    for (Interval& i : *list) i.holds = outcome.intervals_hold();
  return outcome;
}

std::vector<std::string> verdict(const PosteriorOutcome& outcome) {
  std::vector<std::string> text;
  const PosteriorRound& last = outcome.rounds.back();
  const std::string effort = fmt::format("{} rounds with {} renderings ({} of them were there before)",
                                         outcome.rounds.size(), last.renderings, outcome.found);
  if (outcome.converged())
    text.push_back("Settled after " + effort +
                   (last.pooled
                        ? fmt::format("; the last two differ by up to {:.2g} standard deviations, and the answer "
                                      "is both together.",
                                      last.shift)
                        : "."));
  else if (outcome.settled())
    text.push_back("NOT converged: it settled after " + effort +
                   ", but no material that was looked at fits: the intervals do not hold.");
  else
    text.push_back(fmt::format(
        "NOT settled after {}: in the last one a mean still moved by {:.2g} standard deviations, and the emulator "
        "makes {:.2g} % of the variance. {}",
        effort, last.shift, 100 * last.emulator_share,
        outcome.intervals_hold()
            ? "The intervals count in what it does not know; more rounds (iterations) may narrow them."
            : "Nor does a material that was looked at fit: the intervals do not hold."));
  if (outcome.peaks.size() > 1) {
    text.push_back(
        fmt::format("The images fit {} separate groups of materials; mean and interval are over all of them:",
                    outcome.peaks.size()));
    for (const auto& peak : outcome.peaks) {
      std::vector<std::string> parts;
      for (const Interval& i : peak.parameters)
        parts.push_back(fmt::format("{} {:.4g} ({:.4g} to {:.4g})", i.name, i.value, i.low, i.high));
      text.push_back(fmt::format("  with a probability of {:.0f} %: {}", 100 * peak.share, fmt::join(parts, ", ")));
    }
  }
  std::vector<std::string> assumed;
  for (std::size_t p = 0; p < outcome.ranges.size(); ++p) {
    const NaturalRange& range = outcome.ranges[p];
    const Interval& i = outcome.parameters[p];
    assumed.push_back(fmt::format("{} {:.4g} to {:.4g}", i.name, range.low(), range.high()));
    if (range.of(i.high) - range.of(i.low) > 1.6)
      text.push_back(fmt::format("The images hardly tell {}: its interval is nearly all that was looked at.", i.name));
    else if (range.of(i.low) < -0.97 || range.of(i.high) > 0.97)
      text.push_back(fmt::format("{}: its interval reaches the end of what was looked at (range).", i.name));
  }
  text.push_back(fmt::format("Looked at: {}.", fmt::join(assumed, ", ")));
  if (!outcome.question.prior.empty())
    text.push_back(fmt::format("The result and its intervals count in what was known before (95 %): {}.",
                               fmt::join(outcome.question.prior, "; ")));
  if (!outcome.question.noise_known) text.push_back(measured_noise_words());
  text.push_back(words(outcome.fit));
  if (!outcome.misfit.words.empty()) text.push_back(outcome.misfit.words);
  return text;
}

std::string failure(const PosteriorOutcome& outcome) {
  if (outcome.converged()) return "";
  if (!outcome.fit.fits()) return misfit_words({outcome.fit, outcome.misfit});
  return "its rounds have not settled; the intervals count in what it does not know, and more rounds (iterations) may "
         "narrow them.";
}

std::vector<std::string> ambiguity_words(const PosteriorOutcome& outcome, const std::vector<Coordinate>& coordinates) {
  return ambiguity_words(outcome.directions, coordinates, standard_deviation);
}

nlohmann::ordered_json to_json(const PosteriorOutcome& outcome, const std::vector<Coordinate>& coordinates) {
  using Json = nlohmann::ordered_json;
  const std::size_t parameters = outcome.parameters.size();
  Json correlation = Json::object(), peaks = Json::array(), rounds = Json::array(), ranges = Json::object();
  for (std::size_t p = 0; p < parameters; ++p) {
    for (std::size_t q = 0; q < parameters; ++q)
      correlation[outcome.names[p]][outcome.names[q]] =
          outcome.correlation(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(q));
    ranges[outcome.names[p]] = {outcome.ranges[p].low(), outcome.ranges[p].high()};
  }
  for (const auto& peak : outcome.peaks)
    peaks.push_back({{"probability", peak.share}, {"parameters", to_json(peak.parameters)}});
  for (const PosteriorRound& round : outcome.rounds)
    rounds.push_back({{"renderings", round.renderings},
                      {"local", round.local},
                      {"shift", round.shift},
                      {"growth", round.growth},
                      {"emulator_share", round.emulator_share},
                      {"leave_one_out", round.leave_one_out},
                      {"residual", round.residual}});
  Json json{{"schema", "itn.invert/1"},
            {"scene", outcome.question.scene},
            {"method", outcome.question.method},
            {"converged", outcome.converged()},
            {"fit", to_json(outcome.fit)},
            {"misfit", to_json(outcome.misfit)},
            {"parameters", to_json(outcome.parameters)},
            {"coefficients", to_json(outcome.coefficients)},
            {"exposures", to_json(outcome.exposures)},
            {"prior", outcome.question.prior},
            {"range", ranges},
            {"ambiguity", to_json(outcome.directions, coordinates, standard_deviation)},
            {"correlation", correlation},
            {"peaks", peaks},
            {"samples", outcome.question.folder + "/samples.csv"},
            {"loss", outcome.loss},
            {"loss_stderr", outcome.loss_stderr},
            {"residual", outcome.residual},
            {"iterations", outcome.rounds.size()},
            {"rounds", rounds},
            {"renderings", {{"found", outcome.found}, {"made", outcome.made}}},
            {"verdict", verdict(outcome)},
            {"time", {{"total_s", outcome.seconds}}}};
  return json;
}

}  // namespace itn
