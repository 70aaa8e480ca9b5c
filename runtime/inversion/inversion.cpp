#include "runtime/inversion/inversion.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace itn {
namespace {

constexpr int pilot_spp = 16;            // for the noise, before the first iteration
constexpr int concluding_spp = 256;      // at least
constexpr double enough_share = 0.2;     // of the rendering in the variance of the unknowns
constexpr double settled = 0.7;          // steps shorter than this many standard errors end the search
constexpr double lost_in_noise = 1.5;    // steps shorter than this many standard errors of the rendering say nothing
constexpr double largest_step = 1;       // of a coordinate in one iteration
constexpr double least_damping = 1e-6, most_damping = 1e3;

std::vector<double> exposures(const std::vector<double>& x, std::size_t parameters, std::size_t images) {
  std::vector<double> result(images, 1.0);
  for (std::size_t i = parameters; i < x.size(); ++i) result[i - parameters] = std::exp(x[i]);
  return result;
}

}  // namespace

Inversion::Inversion(ForwardModel& model, const std::vector<TargetImage>& targets, const InversionOptions& options)
    : model_(model), targets_(targets), options_(options) {}

std::vector<std::string> Inversion::names() const {
  std::vector<std::string> result;
  for (const Coordinate& c : model_.coordinates()) result.push_back(c.parameter().name);
  for (std::size_t i = 0; options_.exposure && i < targets_.size(); ++i)
    result.push_back(fmt::format("exposure {}", i));
  return result;
}

std::vector<double> Inversion::clamped(std::vector<double> x) const {
  for (std::size_t p = 0; p < model_.coordinates().size(); ++p) x[p] = model_.coordinates()[p].clamp(x[p]);
  return x;
}

std::vector<NoiseModel> Inversion::noise_of(const std::vector<std::vector<Rendering>>& images,
                                            const std::vector<double>& x) {
  const std::vector<double> exposure = exposures(x, model_.coordinates().size(), images.size());
  std::vector<NoiseModel> noise;
  for (std::size_t i = 0; i < images.size(); ++i)
    noise.push_back(noise_model(images[i], targets_[i], options_.relative_noise, exposure[i]));
  return noise;
}

std::vector<NoiseModel> Inversion::noise_at(const std::vector<double>& x, int first, int spp) {
  return noise_of(model_.render(x, first, spp), x);
}

InversionState Inversion::start(const std::vector<double>& x) {
  InversionState state;
  state.x = clamped(x);
  state.spp = options_.method == InversionOptions::Method::adam ? options_.sample_limit()
                                                                : std::min(pilot_spp, options_.sample_limit());
  if (options_.exposure) {
    const auto images = model_.render(state.x, 0, pilot_spp);
    for (std::size_t i = 0; i < images.size(); ++i)
      state.x.push_back(std::log(best_exposure(images[i], targets_[i])));
  }
  state.noise_x = state.x;
  state.noise_spp = pilot_spp;
  state.next_sample = pilot_spp;
  return state;
}

InversionStep Inversion::advance(InversionState& state) {
  const auto images = model_.render(state.x, state.next_sample, state.spp);
  InversionStep step;
  step.iteration = state.iteration;
  step.spp = state.spp;
  step.x = state.x;
  const int first = state.next_sample;
  state.next_sample += state.spp;
  if (options_.method == InversionOptions::Method::adam) {
    adam(images, state, step);
  } else {
    if (noise_sample_ != state.noise_sample || noise_x_ != state.noise_x) {
      noise_ = noise_at(state.noise_x, state.noise_sample, state.noise_spp);
      noise_x_ = state.noise_x;
      noise_sample_ = state.noise_sample;
    }
    const int spp = state.spp;
    gauss_newton(least_squares(images, targets_, noise_, model_.coordinates(), state.x), state, step);
    if (state.spp != spp) {  // more samples: also better weights
      noise_ = noise_of(images, step.x);
      state.noise_x = noise_x_ = step.x;
      state.noise_sample = noise_sample_ = first;
      state.noise_spp = spp;
    }
  }
  ++state.iteration;
  if (state.iteration >= options_.iteration_limit()) state.done = true;
  return step;
}

void Inversion::gauss_newton(const LeastSquares& equations, InversionState& state, InversionStep& step) const {
  step.loss = equations.loss;
  step.loss_stderr = equations.loss_stderr;
  const double tolerance = 4 * std::hypot(equations.cost_stderr, state.accepted_cost_stderr);
  step.accepted = !state.accepted || equations.cost <= state.accepted_cost + tolerance;
  if (!step.accepted) {
    for (std::size_t k = 0; k < state.x.size(); ++k)
      state.x[k] = state.accepted_x[k] + (state.x[k] - state.accepted_x[k]) / 4;
    state.damping = std::min(most_damping, 10 * state.damping);
    return;
  }
  state.accepted = true;
  state.accepted_x = state.x;
  state.accepted_cost = equations.cost;
  state.accepted_cost_stderr = equations.cost_stderr;

  NormalEquations pool = state.pool.empty() ? NormalEquations(state.x.size())
                                            : NormalEquations::from_numbers(state.x.size(), state.pool);
  pool.add(equations, state.x);
  const NormalEquations::Solution solution = pool.solve(state.x, names());
  step.distance = solution.distance(state.x);
  const double share = solution.monte_carlo_share;
  const bool most = state.spp >= options_.sample_limit();
  state.converged = solution.determined && step.distance <= settled && share <= enough_share;
  state.done = state.converged;
  if (!state.converged && !most && (step.distance * step.distance <= lost_in_noise * share || !solution.determined)) {
    const double wanted = solution.determined ? share / std::max(1e-3, 1 - share) / enough_share : 4;
    state.spp = static_cast<int>(std::min<double>(options_.sample_limit(), state.spp * std::clamp(wanted, 2.0, 16.0)));
    state.accepted = false;  // costs compare with the same weights only
    state.pool.clear();
  } else {
    pool.forget(step.distance > 2 ? 0.1 : step.distance > 1 ? 0.5 : 1);
    state.pool = pool.numbers();
  }

  Eigen::VectorXd change = solution.x - Eigen::Map<const Eigen::VectorXd>(state.x.data(), solution.x.size());
  if (!state.converged) {
    Eigen::MatrixXd damped = solution.information;
    damped.diagonal() *= 1 + state.damping;
    change = Eigen::LDLT<Eigen::MatrixXd>(damped).solve(Eigen::VectorXd(solution.information * change));
  }
  state.damping = std::max(least_damping, state.damping / 10);
  change *= std::min(1.0, largest_step / std::max(1e-300, change.cwiseAbs().maxCoeff()));
  for (std::size_t k = 0; k < state.x.size(); ++k) state.x[k] += change[static_cast<Eigen::Index>(k)];
  state.x = clamped(state.x);
}

void Inversion::adam(const std::vector<std::vector<Rendering>>& images, InversionState& state,
                     InversionStep& step) const {
  constexpr double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  const std::size_t parameters = model_.coordinates().size();
  state.first_moment.resize(parameters);
  state.second_moment.resize(parameters);
  std::vector<LossGradient> losses;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const double exposure = options_.exposure ? best_exposure(images[i], targets_[i]) : 1;
    if (options_.exposure) state.x[parameters + i] = step.x[parameters + i] = std::log(exposure);
    losses.push_back(loss_gradient(images[i], targets_[i], exposure));
  }
  const LossGradient loss = mean_of(losses);
  step.loss = loss.loss;
  step.loss_stderr = loss.loss_stderr;
  const int t = state.iteration + 1;
  const double rate =
      options_.learning_rate / 2 * (1 + std::cos(std::numbers::pi * state.iteration / options_.iteration_limit()));
  for (std::size_t p = 0; p < parameters; ++p) {
    const double g = loss.gradient[p] * model_.coordinates()[p].slope(state.x[p]);
    state.first_moment[p] = beta1 * state.first_moment[p] + (1 - beta1) * g;
    state.second_moment[p] = beta2 * state.second_moment[p] + (1 - beta2) * g * g;
    const double mean = state.first_moment[p] / (1 - std::pow(beta1, t));
    const double square = state.second_moment[p] / (1 - std::pow(beta2, t));
    state.x[p] -= rate * mean / (std::sqrt(square) + epsilon);
  }
  state.x = clamped(state.x);
}

Inversion::Conclusion Inversion::conclude(const InversionState& state) {
  Conclusion result;
  const bool pooled = !state.pool.empty();
  result.noise = pooled ? noise_at(state.noise_x, state.noise_sample, state.noise_spp)
                        : noise_at(state.x, state.next_sample, pilot_spp);
  result.images = model_.render(state.x, state.next_sample + pilot_spp, std::max(concluding_spp, state.spp));
  const LeastSquares equations = least_squares(result.images, targets_, result.noise, model_.coordinates(), state.x);
  NormalEquations pool =
      pooled ? NormalEquations::from_numbers(state.x.size(), state.pool) : NormalEquations(state.x.size());
  pool.add(equations, state.x);
  const NormalEquations::Solution solution = pool.solve(state.x, names());
  result.covariance = solution.covariance;
  result.loss = equations.loss;
  result.loss_stderr = equations.loss_stderr;
  result.residual = equations.cost;
  result.residuals = equations.residuals;
  result.distance = solution.distance(state.x);
  result.determined = solution.determined;
  result.x = state.x;
  if (options_.method == InversionOptions::Method::adam) {
    result.converged = result.determined && result.distance <= lost_in_noise;
  } else {
    result.converged = state.converged || (result.determined && result.distance <= settled);
    if (result.converged) result.x = clamped({solution.x.begin(), solution.x.end()});
  }
  return result;
}

}  // namespace itn
