#include "runtime/inversion/least_squares.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "runtime/error.h"

namespace itn {
namespace {

constexpr double least_variance = 1e-3;  // of the image's mean: pixels without noise must not rule

// Mean over 3 x 3 pixels, channel by channel.
std::vector<double> smoothed(const std::vector<double>& data, int width, int height, std::size_t channels) {
  std::vector<double> result(data.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (std::size_t c = 0; c < channels; ++c) {
        double sum = 0, count = 0;
        for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v)
          for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u, ++count)
            sum += data[static_cast<std::size_t>(v * width + u) * channels + c];
        result[static_cast<std::size_t>(y * width + x) * channels + c] = sum / count;
      }
  return result;
}

double mean_over(const std::vector<Rendering>& groups, std::size_t i) {
  double sum = 0, samples = 0;
  for (const Rendering& group : groups) {
    sum += group.spp * static_cast<double>(group.mean[i]);
    samples += group.spp;
  }
  return sum / samples;
}

// Adds one image's part of the equations.
class Sum {
 public:
  Sum(LeastSquares& into, const std::vector<Coordinate>& coordinates, const std::vector<double>& x, std::size_t image)
      : into_(into), unknowns_(into.gradient.size()), parameters_(coordinates.size()) {
    for (std::size_t p = 0; p < parameters_; ++p) slope_.push_back(coordinates[p].slope(x[p]));
    if (x.size() > parameters_) {
      own_exposure_ = static_cast<Eigen::Index>(parameters_ + image);
      exposure_ = std::exp(x[parameters_ + image]);
    }
  }

  void add(const std::vector<Rendering>& groups, const TargetImage& target, const NoiseModel& noise,
           double loss_weight) {
    const auto channels = static_cast<std::size_t>(target.channels);
    count_ = 0;
    square_count_ = 0;
    for (const Rendering& group : groups) {
      count_ += group.spp;
      square_count_ += double(group.spp) * group.spp;
    }
    const double floor = variance_floor(noise);
    for (std::size_t pixel = 0; pixel < target.weight.size(); ++pixel) {
      if (target.weight[pixel] == 0) continue;
      Eigen::VectorXd part = Eigen::VectorXd::Zero(unknowns_);
      Eigen::MatrixXd by_group = Eigen::MatrixXd::Zero(unknowns_, static_cast<Eigen::Index>(groups.size()));
      double loss_noise = 0, cost_noise = 0;
      Eigen::MatrixXd& own_part = into_.information[(static_cast<std::uint32_t>(pixel) * 2654435769U) >> 27];
      for (std::size_t c = 0; c < channels; ++c) {
        const std::size_t i = pixel * channels + c;
        const double sample = exposure_ * exposure_ * noise.sample[i] / count_;  // variance of s T
        const double known = noise.target[i] + sample, variance = std::max(floor, known);
        const double weight = target.weight[pixel] / variance;
        products(groups, i, target.value[i]);
        part += weight * residual_jacobian_;
        by_group += weight * influence_;
        own_part += weight * jacobian_jacobian_;
        into_.plug_in.noalias() += weight * mean_jacobian_ * mean_jacobian_.transpose();
        into_.loss += loss_weight * target.weight[pixel] * residual_residual_;
        if (known > floor) {
          into_.cost += weight * (residual_residual_ + sample);
          into_.residuals += 1;
        }
        // the variance of a squared mean whose noise is normal
        const double spread =
            std::sqrt(4 * std::max(0.0, residual_residual_) * sample + 2 * sample * sample);
        loss_noise += loss_weight * target.weight[pixel] * spread;
        cost_noise += weight * spread;
      }
      into_.gradient += part;
      into_.spread.noalias() += part * part.transpose();
      const auto g = static_cast<double>(groups.size());
      by_group.colwise() -= by_group.rowwise().mean().eval();
      into_.monte_carlo.noalias() += g / (g - 1) * by_group * by_group.transpose();
      into_.loss_stderr += loss_noise * loss_noise;
      into_.cost_stderr += cost_noise * cost_noise;
    }
  }

 private:
  double variance_floor(const NoiseModel& noise) const {
    double sum = 0;
    for (std::size_t i = 0; i < noise.sample.size(); ++i)
      sum += noise.target[i] + exposure_ * exposure_ * noise.sample[i] / count_;
    const double mean = sum / static_cast<double>(noise.sample.size());
    if (!(mean > 0)) throw ResultError("the rendered images are all black, so there is nothing to compare");
    return least_variance * mean;
  }

  // Of pixel and channel i: means, and mean products of different groups.
  void products(const std::vector<Rendering>& groups, std::size_t i, double wanted) {
    const auto count = static_cast<Eigen::Index>(groups.size());
    jacobian_.resize(unknowns_, count);  // each times its number of samples
    jacobian_.setZero();
    residual_.resize(count);
    for (Eigen::Index g = 0; g < count; ++g) {
      const Rendering& group = groups[static_cast<std::size_t>(g)];
      const double n = group.spp, value = n * exposure_ * static_cast<double>(group.mean[i]);
      residual_[g] = value - n * wanted;
      for (std::size_t p = 0; p < parameters_; ++p)
        jacobian_(static_cast<Eigen::Index>(p), g) =
            n * exposure_ * slope_[p] * static_cast<double>(group.derivatives[p].mean[i]);
      if (own_exposure_ >= 0) jacobian_(own_exposure_, g) = value;
    }
    const Eigen::VectorXd all = jacobian_.rowwise().sum();
    const double all_residual = residual_.sum(), pairs = count_ * count_ - square_count_;
    residual_residual_ = (all_residual * all_residual - residual_.squaredNorm()) / pairs;
    residual_jacobian_ = (all_residual * all - jacobian_ * residual_) / pairs;
    jacobian_jacobian_ = (all * all.transpose() - jacobian_ * jacobian_.transpose()) / pairs;
    mean_jacobian_ = all / count_;
    // What each group does to residual_jacobian_ (the projection of a U-statistic).
    influence_ = (all * residual_.transpose() + all_residual * jacobian_ -
                  2 * jacobian_ * residual_.asDiagonal()) / pairs;
  }

  LeastSquares& into_;
  Eigen::Index unknowns_, own_exposure_ = -1;
  std::size_t parameters_;
  std::vector<double> slope_;
  double exposure_ = 1, count_ = 0, square_count_ = 0;
  Eigen::MatrixXd jacobian_, jacobian_jacobian_, influence_;
  Eigen::VectorXd residual_, mean_jacobian_, residual_jacobian_;
  double residual_residual_ = 0;
};

}  // namespace

NoiseModel noise_model(const std::vector<Rendering>& groups, const TargetImage& target, double relative_noise,
                       double exposure) {
  const std::size_t size = target.value.size();
  std::vector<double> sample(size), mean(size);
  for (std::size_t i = 0; i < size; ++i) {
    mean[i] = mean_over(groups, i);
    for (const Rendering& group : groups) {
      const double off = static_cast<double>(group.mean[i]) - mean[i];
      sample[i] += group.spp * off * off / static_cast<double>(groups.size() - 1);
    }
  }
  const auto channels = static_cast<std::size_t>(target.channels);
  NoiseModel noise{smoothed(sample, target.width, target.height, channels), std::vector<double>(size)};
  const std::vector<double> radiance = smoothed(mean, target.width, target.height, channels);
  double wanted = 0, have = 0;
  for (std::size_t i = 0; i < target.error.size(); ++i) {
    if (target.weight[i / channels] == 0) continue;
    wanted += target.error[i];
    have += std::sqrt(noise.sample[i]);
  }
  const double scale = have > 0 ? wanted * wanted / (have * have) : 0;
  for (std::size_t i = 0; i < size; ++i) {
    const double relative = relative_noise * exposure * radiance[i];
    noise.target[i] = scale * noise.sample[i] + relative * relative;
  }
  return noise;
}

LeastSquares least_squares(const std::vector<std::vector<Rendering>>& images, const std::vector<TargetImage>& targets,
                           const std::vector<NoiseModel>& noise, const std::vector<Coordinate>& coordinates,
                           const std::vector<double>& x) {
  LeastSquares sum;
  const auto n = static_cast<Eigen::Index>(x.size());
  sum.gradient = Eigen::VectorXd::Zero(n);
  sum.plug_in = sum.spread = sum.monte_carlo = Eigen::MatrixXd::Zero(n, n);
  sum.information.assign(information_parts, sum.plug_in);
  for (std::size_t t = 0; t < targets.size(); ++t) {
    double weights = 0;
    for (const float weight : targets[t].weight) weights += weight;
    const double all = weights * targets[t].channels * static_cast<double>(targets.size());
    Sum(sum, coordinates, x, t).add(images[t], targets[t], noise[t], 1 / all);
  }
  sum.cost /= sum.residuals;
  sum.cost_stderr = std::sqrt(sum.cost_stderr) / sum.residuals;
  sum.loss_stderr = std::sqrt(sum.loss_stderr);
  return sum;
}

}  // namespace itn
