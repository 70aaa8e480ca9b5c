#include "runtime/inverse/gauss_newton/inversion.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "runtime/base/sample_index.h"

namespace itn {
namespace {

constexpr int pilot_spp = 16;            // for the noise, before the first iteration: at least
constexpr int concluding_spp = 256;      // at least
constexpr double enough_share = 0.2;     // of the rendering in the variance of the unknowns
constexpr double settled = 0.4;          // steps shorter than this many standard errors end the search
constexpr double enough_renderings = 8;  // pooled, with most samples: more are not waited for
constexpr double in_linear_range = 1;    // renderings from farther away than this many standard errors are not pooled
constexpr double lost_in_noise = 1.5;    // steps shorter than this many standard errors of the rendering say nothing
constexpr double much_worse = 1.5;       // a loss that much higher takes the step back
constexpr double largest_step = 1;       // of a coordinate in one iteration
constexpr int better_reference = 4;      // samples of it where noise hides a direction, over the most of a rendering
constexpr int most_sample_number = 1 << 30;
constexpr double least_damping = 1e-6, most_damping = 1e3;

// Samples a pixel for a total of `all` over all pixels: few pixels can afford many samples.
int shared_out(double all, const std::vector<TargetImage>& targets) {
  double pixels = 0;
  for (const TargetImage& target : targets) pixels += double(target.width) * target.height;
  return static_cast<int>(all / pixels);
}

// The derivatives of a few pixels by sixteen samples are noise.
int first_spp(const std::vector<TargetImage>& targets) { return std::max(pilot_spp, shared_out(1 << 12, targets)); }

}  // namespace

int InversionOptions::sample_limit(const std::vector<TargetImage>& targets) const {
  if (spp > 0) return spp;
  return method == Method::adam ? 16 : std::max(1024, shared_out(1 << 18, targets));
}

Inversion::Inversion(ForwardModel& model, const std::vector<TargetImage>& targets, const InversionOptions& options)
    : model_(model), targets_(targets), options_(options) {}

std::vector<std::string> Inversion::names() const {
  std::vector<std::string> result;
  for (const Coordinate& c : model_.coordinates()) result.push_back(c.parameter().name);
  for (std::size_t i = 0; options_.exposure && i < targets_.size(); ++i)
    result.push_back(fmt::format("exposure {}", i));
  if (options_.white_balance) result.insert(result.end(), {"white balance R", "white balance B"});
  return result;
}

std::vector<double> Inversion::clamped(std::vector<double> x) const {
  for (std::size_t p = 0; p < model_.coordinates().size(); ++p) x[p] = model_.coordinates()[p].clamp(x[p]);
  return x;
}

std::vector<Reference> Inversion::references_of(const std::vector<Rendering>& images,
                                                const std::vector<double>& x) const {
  std::vector<Reference> references;
  for (std::size_t i = 0; i < images.size(); ++i)
    references.push_back(reference_of(images[i], targets_[i], i, options_.noise.relative, model_.coordinates(), x,
                                      options_.white_balance));
  return references;
}

void Inversion::take_reference(const std::vector<double>& x, int first, int spp) {
  if (reference_sample_ == first && reference_x_ == x) return;
  references_ = references_of(model_.render(x, first, spp), x);
  reference_x_ = x;
  reference_sample_ = first;
}

InversionState Inversion::start(const std::vector<double>& x) {
  InversionState state;
  state.x = clamped(x);
  const int most = options_.sample_limit(targets_);
  state.spp = options_.method == InversionOptions::Method::adam ? most : std::min(first_spp(targets_), most);
  if (options_.exposure || options_.white_balance) {
    const auto images = model_.render_groups(state.x, 0, first_spp(targets_));
    const auto factor = [&](std::size_t i, int channel) {
      return std::log(best_exposure(images[i], targets_[i], channel));
    };
    for (std::size_t i = 0; options_.exposure && i < images.size(); ++i)
      state.x.push_back(factor(i, options_.white_balance ? 1 : -1));
    for (const int channel : options_.white_balance ? std::vector<int>{0, 2} : std::vector<int>()) {
      double sum = 0;
      for (std::size_t i = 0; i < images.size(); ++i)
        sum += factor(i, channel) - (options_.exposure ? factor(i, 1) : 0);
      state.x.push_back(sum / static_cast<double>(images.size()));
    }
  }
  state.reference_x = state.x;
  state.reference_spp = state.next_sample = first_spp(targets_);
  return state;
}

InversionStep Inversion::advance(InversionState& state) {
  InversionStep step;
  step.iteration = state.iteration;
  step.spp = state.spp;
  step.x = state.x;
  const int first = state.next_sample;
  state.next_sample = following_sample(first, state.spp);
  if (options_.method == InversionOptions::Method::adam) {
    adam(model_.render_groups(state.x, first, state.spp), state, step);
  } else {
    take_reference(state.reference_x, state.reference_sample, state.reference_spp);
    const std::vector<Rendering> images = model_.render(state.x, first, state.spp);
    if (gauss_newton(
            least_squares(images, targets_, references_, model_.coordinates(), state.x, options_.white_balance), state,
            step)) {
      references_ = references_of(images, step.x);
      state.reference_x = reference_x_ = step.x;
      state.reference_sample = reference_sample_ = first;
      state.reference_spp = step.spp;
      state.pool.clear();
    }
  }
  ++state.iteration;
  if (state.iteration >= options_.iteration_limit()) state.done = true;
  return step;
}

bool Inversion::gauss_newton(const LeastSquares& equations, InversionState& state, InversionStep& step) const {
  step.loss = equations.loss;
  step.loss_stderr = equations.loss_stderr;
  // The loss, not the cost: weights change from one iteration to the next.
  const double noise = 4 * std::hypot(equations.loss_stderr, state.accepted_loss_stderr);
  step.accepted = !state.accepted || equations.loss <= much_worse * state.accepted_loss + noise;
  if (!step.accepted) {
    for (std::size_t k = 0; k < state.x.size(); ++k)
      state.x[k] = state.accepted_x[k] + (state.x[k] - state.accepted_x[k]) / 4;
    state.damping = std::min(most_damping, 10 * state.damping);
    return false;
  }
  state.accepted = true;
  state.accepted_x = state.x;
  state.accepted_loss = equations.loss;
  state.accepted_loss_stderr = equations.loss_stderr;

  NormalEquations pool =
      state.pool.empty() ? NormalEquations(state.x.size()) : NormalEquations::from_numbers(state.x.size(), state.pool);
  pool.add(equations, state.x);
  const NormalEquations::Solution solution = pool.solve(state.x, names(), options_.prior);
  step.distance = solution.distance(state.x);
  const double share = solution.monte_carlo_share;
  const int limit = options_.sample_limit(targets_);
  const bool most = state.spp >= limit;
  // The intervals count in the rendering's noise, so they hold with more of it, too.
  const bool tried = most && pool.count() >= enough_renderings;
  state.converged =
      solution.determined && step.distance <= settled && (tried || (!solution.hidden && share <= enough_share));
  state.done = state.converged || (tried && !solution.determined && step.distance <= settled);
  const bool more = !state.converged && !most &&
                    (step.distance * step.distance <= lost_in_noise * lost_in_noise * share || solution.hidden);
  if (more) {
    const double wanted = solution.hidden ? 4 : share / std::max(1e-3, 1 - share) / enough_share;
    state.spp = static_cast<int>(std::min<double>(limit, state.spp * std::clamp(wanted, 2.0, 16.0)));
  }
  state.pool = pool.numbers();

  Eigen::VectorXd change = solution.x - Eigen::Map<const Eigen::VectorXd>(state.x.data(), solution.x.size());
  if (!state.converged) {
    Eigen::MatrixXd damped = solution.information;
    damped.diagonal() *= 1 + state.damping;
    change = Eigen::PartialPivLU<Eigen::MatrixXd>(damped).solve(Eigen::VectorXd(solution.information * change));
  }
  state.damping = std::max(least_damping, state.damping / 10);
  change *= std::min(1.0, largest_step / std::max(1e-300, change.cwiseAbs().maxCoeff()));
  for (std::size_t k = 0; k < state.x.size(); ++k) state.x[k] += change[static_cast<Eigen::Index>(k)];
  state.x = clamped(state.x);
  // Instruments of less noise tell as much as that many times the renderings.
  const int better = better_reference * limit;
  if (!state.done && most && solution.hidden && step.distance <= in_linear_range && state.reference_spp < better &&
      state.next_sample < most_sample_number - better) {
    state.reference_x = step.x;
    state.reference_sample = state.next_sample;
    state.reference_spp = better;
    state.next_sample += better;
    state.pool.clear();
    return false;
  }
  return !state.converged && (more || step.distance > in_linear_range);
}

void Inversion::adam(const std::vector<std::vector<Rendering>>& images, InversionState& state,
                     InversionStep& step) const {
  const std::size_t parameters = model_.coordinates().size();
  std::vector<LossGradient> losses;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const double exposure = options_.exposure ? best_exposure(images[i], targets_[i]) : 1;
    if (options_.exposure) state.x[parameters + i] = step.x[parameters + i] = std::log(exposure);
    losses.push_back(loss_gradient(images[i], targets_[i], exposure));
  }
  const LossGradient loss = mean_of(losses);
  step.loss = loss.loss;
  step.loss_stderr = loss.loss_stderr;
  std::vector<double> gradient;
  for (std::size_t p = 0; p < parameters; ++p)
    gradient.push_back(loss.gradient[p] * model_.coordinates()[p].slope(state.x[p]));
  adam_step(state.x, gradient, state.moments, state.iteration, options_.iteration_limit(), options_.learning_rate);
  state.x = clamped(state.x);
}

Inversion::Conclusion Inversion::conclude(const InversionState& state) {
  Conclusion result;
  const bool pooled = !state.pool.empty();
  if (pooled)
    take_reference(state.reference_x, state.reference_sample, state.reference_spp);
  else
    take_reference(state.x, state.next_sample, concluding_spp);
  result.references = references_;
  result.images =
      model_.render(state.x, following_sample(state.next_sample, concluding_spp), std::max(concluding_spp, state.spp));
  const LeastSquares equations =
      least_squares(result.images, targets_, references_, model_.coordinates(), state.x, options_.white_balance);
  for (std::size_t t = 0; t < targets_.size(); ++t)
    result.white.push_back(white_residual(
        result.images[t], targets_[t], camera_factors(state.x, model_.coordinates().size(), t, options_.white_balance),
        references_[t].noise));
  result.fit = image_fit(result.white, options_.noise.known);
  NormalEquations pool =
      pooled ? NormalEquations::from_numbers(state.x.size(), state.pool) : NormalEquations(state.x.size());
  pool.add(equations, state.x);
  const NormalEquations::Solution solution = pool.solve(state.x, names(), options_.prior);
  result.covariance = solution.covariance;
  result.loss = equations.loss;
  result.loss_stderr = equations.loss_stderr;
  result.residual = equations.cost;
  result.residuals = equations.residuals;
  result.distance = solution.distance(state.x);
  result.hidden = solution.hidden;
  result.determined = solution.determined;
  result.x = state.x;
  if (options_.method == InversionOptions::Method::adam) {
    result.converged = result.determined && result.distance <= lost_in_noise;
  } else {
    result.converged = state.converged || (result.determined && result.distance <= settled);
    if (result.converged) result.x = clamped({solution.x.begin(), solution.x.end()});
  }
  for (std::size_t t = 0; t < targets_.size(); ++t)
    result.factors.push_back(camera_factors(result.x, model_.coordinates().size(), t, options_.white_balance));
  return result;
}

}  // namespace itn
