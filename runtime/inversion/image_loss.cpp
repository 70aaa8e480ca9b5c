#include "runtime/inversion/image_loss.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "runtime/base/error.h"

namespace itn {
namespace {

constexpr int most_groups = 16;

// Sums over groups of n x, n y and n^2 x y, n the samples of a group: of a value and one of its derivatives, or of the
// value with itself.
struct PairSum {
  double x = 0, y = 0, xy = 0, n = 0, nn = 0;

  void add(double samples, double value, double other, double sign = 1) {
    x += sign * samples * value;
    y += sign * samples * other;
    xy += sign * samples * samples * value * other;
    n += sign * samples;
    nn += sign * samples * samples;
  }
  double product() const { return (x * y - xy) / (n * n - nn); }
  double mean_y() const { return y / n; }
};

}  // namespace

std::vector<int> split_samples(int spp) {
  const int groups = std::min(spp, most_groups);
  std::vector<int> samples(static_cast<std::size_t>(groups), spp / groups);
  for (int g = 0; g < spp % groups; ++g) ++samples[static_cast<std::size_t>(g)];
  return samples;
}

namespace {

// The variance of an estimate from pairs of groups, the mean of h(i, j) over them: with h = mean + g(i) + g(j) + s(i,
// j), of which all are uncorrelated, it is what the g and what the s give. Both are told apart as in the analysis of
// crosses of lines (Griffing 1956, method 4), so that the estimate is unbiased. The jackknife alone takes the part of
// the s 2 (n - 1)/(n - 2) times: most of the variance where there are few groups.
class PairVariance {
 public:
  explicit PairVariance(const std::vector<Rendering>& groups) : n_(groups.size()), h_(n_), of_group_(n_) {
    double total = 0, squares = 0, inverse = 0, inverse_square = 0;
    for (const Rendering& group : groups) {
      const double k = group.spp;
      total += k;
      squares += k * k;
      inverse += 1 / k;
      inverse_square += 1 / (k * k);
    }
    const double pairs = (total * total - squares) / 2;  // of samples
    double linear = 0;
    for (const Rendering& group : groups) linear += group.spp * std::pow((total - group.spp) / pairs, 2);
    const auto n = static_cast<double>(n_);
    // Groups may differ by one sample: from the variances of a group's mean to those of a sample.
    of_g_ = linear / (inverse / n);
    of_s_ = 1 / pairs / ((inverse * inverse - inverse_square) / (n * (n - 1)));
  }

  // Of one pixel. h(i, sums): adds h(i, j) to sums[j] for all j
  template <class AddRow>
  double operator()(const AddRow& add_row) {
    std::fill(of_group_.begin(), of_group_.end(), 0.0);
    double all = 0, squares = 0;
    for (std::size_t i = 0; i < n_; ++i) {
      std::fill(h_.begin(), h_.end(), 0.0);
      add_row(i, h_);
      for (std::size_t j = i + 1; j < n_; ++j) {
        of_group_[i] += h_[j];
        of_group_[j] += h_[j];
        squares += h_[j] * h_[j];
        all += h_[j];
      }
    }
    double group_squares = 0;
    for (const double sum : of_group_) group_squares += sum * sum;
    const auto n = static_cast<double>(n_);
    const double between = (group_squares - 4 * all * all / n) / (n - 2) / (n - 1);
    if (n_ == 3) return (n - 1) * (n - 1) / n * (n - 2) * between;  // too few to tell them apart: the jackknife
    const double within = (squares - group_squares / (n - 2) + 2 * all * all / ((n - 1) * (n - 2))) / (n * (n - 3) / 2);
    return of_g_ * (between - within) / (n - 2) + of_s_ * within;
  }

 private:
  std::size_t n_;
  std::vector<double> h_, of_group_;
  double of_g_ = 0, of_s_ = 0;
};

}  // namespace

LossGradient loss_gradient(const std::vector<Rendering>& groups, const TargetImage& target, double exposure,
                           bool errors) {
  const std::size_t parameters = groups.front().derivatives.size(), count = groups.size();
  const std::size_t channels = static_cast<std::size_t>(target.channels);
  constexpr std::size_t least_groups = 3;
  // The loss first, then the gradient.
  const bool spread = errors && count >= least_groups;
  std::vector<double> sum(1 + parameters), variance(1 + parameters);
  double weights = 0;
  PairVariance pair_variance(groups);
  std::vector<double> x(channels * count), y(channels * count);  // of a pixel
  for (std::size_t pixel = 0; pixel < target.weight.size(); ++pixel) {
    const double weight = target.weight[pixel];
    weights += weight;
    if (weight == 0) continue;
    for (std::size_t k = 0; k <= parameters; ++k) {
      const double factor = k == 0 ? 1 : 2;
      double all = 0;
      for (std::size_t c = 0; c < channels; ++c) {
        const std::size_t i = pixel * channels + c;
        const double wanted = target.value[i];
        PairSum pairs;
        for (std::size_t g = 0; g < count; ++g) {
          const Rendering& group = groups[g];
          x[c * count + g] = exposure * static_cast<double>(group.mean[i]);
          y[c * count + g] = exposure * static_cast<double>(k == 0 ? group.mean[i] : group.derivatives[k - 1].mean[i]);
          pairs.add(group.spp, x[c * count + g], y[c * count + g]);
        }
        // (T - I)^2 = T^2 - 2 I T + I^2, and 2 (T - I) dT
        all += k == 0 ? pairs.product() - 2 * wanted * pairs.mean_y() + wanted * wanted
                      : 2 * (pairs.product() - wanted * pairs.mean_y());
      }
      sum[k] += weight * all;
      if (!spread) continue;
      // (x_i - I) y_j, of both orders
      variance[k] += weight * weight * pair_variance([&](std::size_t i, std::vector<double>& h) {
                       for (std::size_t c = 0; c < channels; ++c) {
                         const double wanted = target.value[pixel * channels + c] * (k == 0 ? 2 : 1);
                         const double* xs = &x[c * count];
                         const double* ys = &y[c * count];
                         const double x_i = factor / 2 * (xs[i] - wanted), y_i = factor / 2 * ys[i], own = wanted * y_i;
                         for (std::size_t j = 0; j < count; ++j) h[j] += x_i * ys[j] + y_i * xs[j] - own;
                       }
                     });
    }
  }
  LossGradient result;
  const double scale = 1 / (weights * static_cast<double>(channels));
  // Of single pixels the unbiased estimate may be below 0, and of very few ones their sum.
  const auto error = [&](double v) {
    return spread ? std::sqrt(std::max(v, 0.0)) * scale : std::numeric_limits<double>::infinity();
  };
  result.loss = sum[0] * scale;
  result.loss_stderr = error(variance[0]);
  for (std::size_t p = 0; p < parameters; ++p) {
    result.gradient.push_back(sum[1 + p] * scale);
    result.gradient_stderr.push_back(error(variance[1 + p]));
  }
  return result;
}

std::vector<std::vector<double>> loss_weights(const std::vector<Rendering>& groups, const TargetImage& target,
                                              double exposure) {
  const auto channels = static_cast<std::size_t>(target.channels);
  std::vector<std::vector<double>> weights(groups.size(), std::vector<double>(target.value.size()));
  double all = 0;
  for (const float weight : target.weight) all += weight;
  for (std::size_t i = 0; i < target.value.size(); ++i) {
    const double weight = target.weight[i / channels] / (all * static_cast<double>(channels));
    if (weight == 0) continue;
    PairSum pairs;
    for (const Rendering& group : groups) pairs.add(group.spp, exposure * static_cast<double>(group.mean[i]), 0);
    // 2 (product() - wanted mean_y()), of which each y is a factor
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const double n = groups[g].spp, x = exposure * static_cast<double>(groups[g].mean[i]);
      const double others = (pairs.x - n * x) * n / (pairs.n * pairs.n - pairs.nn);
      weights[g][i] = 2 * weight * exposure * (others - static_cast<double>(target.value[i]) * n / pairs.n);
    }
  }
  return weights;
}

double best_exposure(const std::vector<Rendering>& groups, const TargetImage& target, int channel) {
  const auto channels = static_cast<std::size_t>(target.channels);
  double with_target = 0, square = 0;
  for (std::size_t i = 0; i < target.value.size(); ++i) {
    if (channel >= 0 && i % channels != static_cast<std::size_t>(channel)) continue;
    const double weight = target.weight[i / channels];
    PairSum pairs;
    for (const Rendering& group : groups) pairs.add(group.spp, group.mean[i], group.mean[i]);
    with_target += weight * target.value[i] * pairs.mean_y();
    square += weight * pairs.product();
  }
  if (!(with_target > 0 && square > 0))
    throw ResultError("exposure: the rendered image or the target is black, or lost in noise: no factor between them");
  return with_target / square;
}

LossGradient mean_of(const std::vector<LossGradient>& images) {
  LossGradient mean = images.front();
  const auto n = static_cast<double>(images.size());
  const auto combine = [&](auto value, auto error) {
    double sum = 0, square = 0;
    for (const LossGradient& image : images) {
      sum += value(image);
      square += error(image) * error(image);
    }
    return std::pair{sum / n, std::sqrt(square) / n};
  };
  std::tie(mean.loss, mean.loss_stderr) =
      combine([](const LossGradient& i) { return i.loss; }, [](const LossGradient& i) { return i.loss_stderr; });
  for (std::size_t p = 0; p < mean.gradient.size(); ++p)
    std::tie(mean.gradient[p], mean.gradient_stderr[p]) =
        combine([&](const LossGradient& i) { return i.gradient[p]; },
                [&](const LossGradient& i) { return i.gradient_stderr[p]; });
  return mean;
}

}  // namespace itn
