#include "runtime/inverse/posterior/sampler.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/base/random.h"
#include "runtime/inverse/posterior/low_discrepancy.h"

namespace itn {
namespace {

constexpr double effective_share = 0.5;  // of the samples, that a step to the next power leaves
constexpr int most_powers = 200;
constexpr double enough_accepted = 2;  // moves a sample, on the mean
constexpr int most_moves = 30;

// Random numbers of one sample's move.
class Draw {
 public:
  Draw(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}
  double uniform() { return random_uniform(seed_, stream_, next_++); }
  double normal() {
    const double u = uniform();
    return normal_from(u, uniform());
  }
  std::size_t below(std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(uniform() * static_cast<double>(count)));
  }

 private:
  std::uint64_t seed_, stream_, next_ = 0;
};

// Back into the cube, as by mirrors.
double reflected(double x) {
  x = std::fmod(std::fabs(x + 1), 4.0);
  return (x > 2 ? 4 - x : x) - 1;
}

double effective(const Eigen::ArrayXd& log_weight) {
  const Eigen::ArrayXd weight = (log_weight - log_weight.maxCoeff()).exp();
  return weight.sum() * weight.sum() / weight.square().sum();
}

class Population {
 public:
  Population(const Frame& frame, const LogDensity& log_prior, const LogDensity& log_likelihood,
             const SamplerOptions& options)
      : frame_(frame), prior_(log_prior), likelihood_(log_likelihood), options_(options) {
    const Eigen::Index dimensions = frame.centre.size(), count = options.samples;
    state.at.resize(dimensions, count);
    state.log_prior.resize(count);
    state.log_likelihood.resize(count);
    constexpr Eigen::Index most_tries = 200;  // a sample: of a turned box a part may lie outside of the cube
    Eigen::Index found = 0;
    for (Eigen::Index i = 0; i < most_tries * count && found < count; ++i) {
      const Eigen::VectorXd at = frame.centre + frame.axes * low_discrepancy_point(dimensions, static_cast<int>(i));
      if (at.cwiseAbs().maxCoeff() <= 1) state.at.col(found++) = at;
    }
    for (Eigen::Index i = found; i < count; ++i)
      state.at.col(i) = found > 0 ? Eigen::VectorXd(state.at.col(i % found)) : frame.centre.cwiseMax(-1).cwiseMin(1);
    parallel_for(count, [&](Eigen::Index i) {
      state.log_prior[i] = log_prior(state.at.col(i));
      state.log_likelihood[i] = log_likelihood(state.at.col(i));
    });
  }

  // Copies of these in turn.
  Population(const Frame& frame, const LogDensity& log_prior, const LogDensity& log_likelihood,
             const SamplerOptions& options, const Samples& from)
      : state(from), frame_(frame), prior_(log_prior), likelihood_(log_likelihood), options_(options) {
    const Eigen::Index count = options.samples;
    state.at.resize(from.at.rows(), count);
    state.log_prior.resize(count);
    state.log_likelihood.resize(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Index k = i % from.at.cols();
      state.at.col(i) = from.at.col(k);
      state.log_prior[i] = from.log_prior[k];
      state.log_likelihood[i] = from.log_likelihood[k];
    }
  }

  // As many samples as before, each as often as its weight says.
  void resample(const Eigen::ArrayXd& log_weight) {
    Eigen::ArrayXd weight = (log_weight - log_weight.maxCoeff()).exp();
    weight /= weight.sum();
    const Samples before = state;
    const Eigen::Index count = weight.size();
    double sum = weight[0];
    Eigen::Index from = 0;
    const double offset = random_uniform(options_.seed, 1 + stream_++, 0);
    for (Eigen::Index i = 0; i < count; ++i) {
      const double wanted = (static_cast<double>(i) + offset) / static_cast<double>(count);
      while (sum < wanted && from + 1 < count) sum += weight[++from];
      state.at.col(i) = before.at.col(from);
      state.log_prior[i] = before.log_prior[from];
      state.log_likelihood[i] = before.log_likelihood[from];
    }
  }

  // Metropolis steps of every sample at a power of the likelihood.
  void move(double power) {
    double accepted_in_all = 0;
    for (int k = 0; k < most_moves && (k < options_.moves || accepted_in_all < enough_accepted); ++k) {
      const double share = sweep(power, k % 5 == 4);
      accepted_in_all += share;
      state.acceptance = share;
      scale_ = std::clamp(scale_ * std::exp(share - 0.25), 0.05, 2.0);
    }
  }

  Samples state;

 private:
  // Differences are those of samples that stand still meanwhile: of the other half.
  double sweep(double power, bool jump) {
    const Eigen::Index count = state.at.cols(), dimensions = state.at.rows(), half = count / 2;
    const double length = jump ? 1 : scale_ * 2.38 / std::sqrt(2.0 * static_cast<double>(dimensions));
    std::atomic<int> accepted{0};
    for (int side = 0; side < 2; ++side) {
      const Eigen::Index first = side == 0 ? 0 : half, end = side == 0 ? half : count;
      const Eigen::Index others = side == 0 ? half : 0, other_count = side == 0 ? count - half : half;
      const std::uint64_t stream = 1 + stream_++;
      parallel_for(end - first, [&](Eigen::Index k) {
        const Eigen::Index i = first + k;
        Draw draw(options_.seed ^ 0x5eed, stream * 1000003u + static_cast<std::uint64_t>(i));
        const auto a = others + static_cast<Eigen::Index>(draw.below(static_cast<std::size_t>(other_count)));
        const auto b = others + static_cast<Eigen::Index>(draw.below(static_cast<std::size_t>(other_count)));
        const Eigen::VectorXd way = length * (state.at.col(a) - state.at.col(b));
        Eigen::VectorXd to = state.at.col(i) + way;
        for (Eigen::Index j = 0; j < dimensions; ++j)
          to[j] = reflected(to[j] + (1e-4 + 0.02 * std::fabs(way[j])) * draw.normal());
        if (frame_.reach(to) > 1) return;
        const double log_prior = prior_(to);
        const double threshold = std::log(draw.uniform());
        const double log_likelihood = likelihood_(to);
        const double gain = log_prior - state.log_prior[i] + power * (log_likelihood - state.log_likelihood[i]);
        if (!(gain > threshold)) return;
        state.at.col(i) = to;
        state.log_prior[i] = log_prior;
        state.log_likelihood[i] = log_likelihood;
        ++accepted;
      });
    }
    return accepted / static_cast<double>(count);
  }

  const Frame& frame_;
  const LogDensity& prior_;
  const LogDensity& likelihood_;
  SamplerOptions options_;
  double scale_ = 1;
  std::uint64_t stream_ = 0;
};

}  // namespace

Samples sample_posterior(const Frame& frame, const LogDensity& log_prior, const LogDensity& log_likelihood,
                         const SamplerOptions& options) {
  Population population(frame, log_prior, log_likelihood, options);
  Samples& state = population.state;
  population.resample(state.log_prior.array());
  population.move(0);
  double power = 0;
  bool past_broad = false;
  for (int k = 0; k < most_powers && power < 1; ++k) {
    // The largest step that leaves enough of the samples effective.
    double low = 0, high = 1 - power;
    if (effective(high * state.log_likelihood.array()) < effective_share * options.samples) {
      for (int b = 0; b < 40; ++b) {
        const double middle = (low + high) / 2;
        (effective(middle * state.log_likelihood.array()) < effective_share * options.samples ? high : low) = middle;
      }
      high = std::max(low, 1e-12);
    }
    if (!past_broad && power + high > options.broad) high = std::max(1e-12, options.broad - power);
    const Eigen::ArrayXd log_weight = high * state.log_likelihood.array();
    state.log_evidence += std::log((log_weight - log_weight.maxCoeff()).exp().mean()) + log_weight.maxCoeff();
    population.resample(log_weight);
    power = power + high > 1 - 1e-9 ? 1 : power + high;
    population.move(power);
    if (!past_broad && power >= options.broad - 1e-9) {
      past_broad = true;
      state.broad = state.at;
    }
  }
  if (!past_broad) state.broad = state.at;
  return state;
}

Samples more_samples(const Frame& frame, const LogDensity& log_prior, const LogDensity& log_likelihood,
                     const SamplerOptions& options, const Samples& from) {
  constexpr int rounds = 3;  // of moves, so that copies know nothing of each other
  Population population(frame, log_prior, log_likelihood, options, from);
  for (int k = 0; k < rounds; ++k) population.move(1);
  return population.state;
}

}  // namespace itn
