#include "runtime/inverse/image_loss.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "itn/error.h"

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

  // Adds one pixel. h(i, sums): adds h(i, j) to sums[j] for all j
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
  // The unbiased estimate may be below 0 for single pixels, and so may its sum over very few.
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

namespace {

// The gradient is a mean over pairs of different groups of h(i, j) = (T_i - I) dT_j = mean + u(i) + v(j) + s(i, j). Its
// variance is linear / N + pairs / (N^2 - sum of n^2): of the u + v and the s, by N samples in groups of n. A contrast
// is the sum of c(i, j) h(i, j) where the c, symmetric, add up to 0.
struct PairContrast {
  Eigen::MatrixXd c;
  double linear = 0, pairs = 0;  // shares of the two in its variance

  PairContrast(Eigen::MatrixXd weights, const Eigen::VectorXd& n) : c(std::move(weights)) {
    linear = (c.rowwise().sum().array().square() / n.array()).sum();
    pairs = n.cwiseInverse().dot(c.cwiseAbs2() * n.cwiseInverse());
  }
};

Eigen::VectorXd signs(Eigen::Index count, unsigned pattern) {
  return Eigen::VectorXd::NullaryExpr(
      count, [&](Eigen::Index i) { return std::popcount(static_cast<unsigned>(i) & pattern) % 2 == 0 ? 1.0 : -1.0; });
}

// n(i) n(j) of pairs, times what is said of i and j.
Eigen::MatrixXd of_pairs(const Eigen::VectorXd& n, const Eigen::MatrixXd& by) {
  Eigen::MatrixXd c = (n * n.transpose()).cwiseProduct(by);
  c.diagonal().setZero();
  return c;
}

// Half of the groups against the others: sees u + v, and the s of pairs of one side.
PairContrast of_groups(const Eigen::VectorXd& n, unsigned pattern) {
  const Eigen::VectorXd partners = n.cwiseProduct((n.sum() - n.array()).matrix());
  Eigen::VectorXd side = signs(n.size(), pattern);
  side.array() -= partners.dot(side) / partners.sum();
  const Eigen::RowVectorXd one = Eigen::RowVectorXd::Ones(n.size());
  return {of_pairs(n, side * one + (side * one).transpose()), n};
}

// Pairs of one side against pairs of both: sees the s alone, since every group's pairs add up to 0.
PairContrast of_pairs(const Eigen::VectorXd& n, unsigned pattern) {
  const Eigen::VectorXd side = signs(n.size(), pattern);
  const Eigen::MatrixXd together = side * side.transpose();
  Eigen::MatrixXd equations = Eigen::VectorXd::Ones(n.size()) * n.transpose();
  equations.diagonal() = n.sum() - n.array();
  const Eigen::VectorXd rest = (together - Eigen::MatrixXd::Identity(n.size(), n.size())) * n;
  const Eigen::VectorXd own = equations.partialPivLu().solve(rest);
  const Eigen::RowVectorXd one = Eigen::RowVectorXd::Ones(n.size());
  return {of_pairs(n, together - own * one - (own * one).transpose()), n};
}

// Contrasts of the gradient between some of the groups: these suffice for the variance of a sample.
class LossContrasts {
 public:
  LossContrasts(const std::vector<Rendering>& groups, std::size_t pixels) {
    constexpr int many_samples = 256;  // a pixel: pairs hardly count, and half of the samples tell the rest
    constexpr Eigen::Index half = most_groups / 2, fewest = 4;
    constexpr std::size_t wanted = 64, most = 3;  // pixels, and contrasts where there are fewer
    Eigen::VectorXd n(static_cast<Eigen::Index>(groups.size()));
    for (Eigen::Index g = 0; g < n.size(); ++g) n[g] = groups[static_cast<std::size_t>(g)].spp;
    const double pairs = n.sum() * n.sum() - n.squaredNorm();
    const auto repeats = static_cast<unsigned>(
        std::min({most, std::max<std::size_t>(1, wanted / pixels), static_cast<std::size_t>(n.size() - 1)}));
    const Eigen::Index of_linear = n.sum() < many_samples ? n.size() : std::min(half, n.size());
    for (unsigned k = 0; k < repeats; ++k) {
      const PairContrast linear = of_groups(n.head(of_linear), k + 1);
      const double factor = 1 / n.sum() / linear.linear / repeats;  // the same for unequal groups but for a thousandth
      contrasts_.push_back({0, linear.c, factor});
      if (n.size() < fewest) continue;  // too few to tell them apart: on the high side, as a jackknife
      const Eigen::Index first = fewest * (static_cast<Eigen::Index>(k) % (n.size() / fewest));
      const PairContrast of = of_pairs(n.segment(first, fewest), k + 1);
      contrasts_.push_back({first, of.c, (1 / pairs / repeats - factor * linear.pairs) / of.pairs});
    }
  }

  // Adds to the weights at i, for one value of the image. x: each group's value less the target's.
  void weigh(const std::vector<double>& x, double factor, std::size_t i, std::vector<GradientContrast>& result) const {
    for (std::size_t k = 0; k < contrasts_.size(); ++k) {
      const Contrast& contrast = contrasts_[k];
      const Eigen::Index size = contrast.c.rows();
      const Eigen::VectorXd y =
          contrast.c * Eigen::Map<const Eigen::VectorXd>(x.data() + contrast.first, size) * factor;
      for (Eigen::Index g = 0; g < size; ++g) result[k].weights[static_cast<std::size_t>(contrast.first + g)][i] = y[g];
    }
  }

  std::vector<GradientContrast> empty(std::size_t groups, std::size_t values) const {
    std::vector<GradientContrast> result;
    for (const Contrast& contrast : contrasts_) {
      GradientContrast& of = result.emplace_back();
      of.factor = contrast.factor;
      of.weights.resize(groups);
      for (Eigen::Index g = 0; g < contrast.c.rows(); ++g)
        of.weights[static_cast<std::size_t>(contrast.first + g)].resize(values);
    }
    return result;
  }

 private:
  struct Contrast {
    Eigen::Index first;  // group
    Eigen::MatrixXd c;
    double factor;
  };

  std::vector<Contrast> contrasts_;
};

}  // namespace

GradientWeights loss_weights(const std::vector<Rendering>& groups, const TargetImage& target, double exposure,
                             bool errors) {
  const auto channels = static_cast<std::size_t>(target.channels);
  constexpr std::size_t least_groups = 3;
  GradientWeights result(std::vector<std::vector<double>>(groups.size(), std::vector<double>(target.value.size())));
  std::optional<LossContrasts> contrasts;
  if (errors && groups.size() >= least_groups) {
    contrasts.emplace(groups, target.weight.size());
    result.contrasts = contrasts->empty(groups.size(), target.value.size());
  }
  double all = 0;
  for (const float weight : target.weight) all += weight;
  std::vector<double> of_groups(groups.size());
  for (std::size_t i = 0; i < target.value.size(); ++i) {
    const double weight = target.weight[i / channels] / (all * static_cast<double>(channels));
    if (weight == 0) continue;
    const auto wanted = static_cast<double>(target.value[i]);
    PairSum pairs;
    for (const Rendering& group : groups) pairs.add(group.spp, exposure * static_cast<double>(group.mean[i]), 0);
    // 2 (product() - wanted mean_y()), of which each y is a factor
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const double n = groups[g].spp, x = exposure * static_cast<double>(groups[g].mean[i]);
      const double others = (pairs.x - n * x) * n / (pairs.n * pairs.n - pairs.nn);
      result.values[g][i] = 2 * weight * exposure * (others - wanted * n / pairs.n);
      of_groups[g] = x - wanted;
    }
    if (contrasts) contrasts->weigh(of_groups, 2 * weight * exposure, i, result.contrasts);
  }
  return result;
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
