#include "runtime/inversion/least_squares.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "runtime/error.h"

namespace itn {
namespace {

constexpr std::size_t parts = 32;
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
      Eigen::VectorXd part = Eigen::VectorXd::Zero(unknowns_), random = part;
      double loss_noise = 0, cost_noise = 0;
      Eigen::MatrixXd& own_part = into_.information_parts[(static_cast<std::uint32_t>(pixel) * 2654435769U) >> 27];
      for (std::size_t c = 0; c < channels; ++c) {
        const std::size_t i = pixel * channels + c;
        const double sample = exposure_ * exposure_ * noise.sample[i] / count_;  // variance of s T
        const double known = noise.target[i] + sample, variance = std::max(floor, known);
        const double weight = target.weight[pixel] / variance;
        products(groups, i, target.value[i]);
        part += weight * residual_jacobian_;
        random += weight * std::sqrt(sample) * mean_jacobian_;
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
      into_.monte_carlo.noalias() += random * random.transpose();
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
    mean_jacobian_ = Eigen::VectorXd::Zero(unknowns_);
    residual_jacobian_ = mean_jacobian_;
    jacobian_jacobian_ = Eigen::MatrixXd::Zero(unknowns_, unknowns_);
    double mean_residual = 0;
    residual_residual_ = 0;
    Eigen::VectorXd jacobian = mean_jacobian_;
    for (const Rendering& group : groups) {
      const double n = group.spp, value = exposure_ * static_cast<double>(group.mean[i]), residual = value - wanted;
      for (std::size_t p = 0; p < parameters_; ++p)
        jacobian[static_cast<Eigen::Index>(p)] =
            exposure_ * slope_[p] * static_cast<double>(group.derivatives[p].mean[i]);
      if (own_exposure_ >= 0) jacobian[own_exposure_] = value;
      mean_residual += n * residual;
      mean_jacobian_ += n * jacobian;
      residual_residual_ -= n * n * residual * residual;
      residual_jacobian_ -= n * n * residual * jacobian;
      jacobian_jacobian_.noalias() -= n * n * jacobian * jacobian.transpose();
    }
    const double pairs = count_ * count_ - square_count_;
    residual_residual_ = (residual_residual_ + mean_residual * mean_residual) / pairs;
    residual_jacobian_ = (residual_jacobian_ + mean_residual * mean_jacobian_) / pairs;
    jacobian_jacobian_ = (jacobian_jacobian_ + mean_jacobian_ * mean_jacobian_.transpose()) / pairs;
    mean_jacobian_ /= count_;
  }

  LeastSquares& into_;
  Eigen::Index unknowns_, own_exposure_ = -1;
  std::size_t parameters_;
  std::vector<double> slope_;
  double exposure_ = 1, count_ = 0, square_count_ = 0;
  Eigen::VectorXd mean_jacobian_, residual_jacobian_;
  Eigen::MatrixXd jacobian_jacobian_;
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
  sum.information = sum.plug_in = sum.spread = sum.monte_carlo = Eigen::MatrixXd::Zero(n, n);
  sum.information_parts.assign(parts, sum.information);
  for (std::size_t t = 0; t < targets.size(); ++t) {
    double weights = 0;
    for (const float weight : targets[t].weight) weights += weight;
    const double all = weights * targets[t].channels * static_cast<double>(targets.size());
    Sum(sum, coordinates, x, t).add(images[t], targets[t], noise[t], 1 / all);
  }
  for (const Eigen::MatrixXd& part : sum.information_parts) sum.information += part;
  sum.cost /= sum.residuals;
  sum.cost_stderr = std::sqrt(sum.cost_stderr) / sum.residuals;
  sum.loss_stderr = std::sqrt(sum.loss_stderr);
  return sum;
}

PositiveInformation positive_information(const LeastSquares& equations, const std::vector<std::string>& names) {
  for (Eigen::Index k = 0; k < equations.plug_in.rows(); ++k)
    if (!(equations.plug_in(k, k) > 0))
      throw ResultError(fmt::format("{}: no compared pixel depends on it, so the target cannot tell it; leave it out, "
                                    "or show a part of the scene where it matters",
                                    names[static_cast<std::size_t>(k)]));
  // In the coordinates where the plug-in is the identity. Unit diagonal first: the unknowns' scales differ.
  const Eigen::VectorXd scale = equations.plug_in.diagonal().cwiseSqrt();
  const auto unit = [&](const Eigen::MatrixXd& m) {
    return Eigen::MatrixXd(scale.cwiseInverse().asDiagonal() * m * scale.cwiseInverse().asDiagonal());
  };
  constexpr double ridge = 1e-12;
  const Eigen::LLT<Eigen::MatrixXd> root(unit(equations.plug_in) +
                                         ridge * Eigen::MatrixXd::Identity(scale.size(), scale.size()));
  const Eigen::MatrixXd l = root.matrixL();
  const auto relative = [&](const Eigen::MatrixXd& m) {
    const Eigen::MatrixXd half = root.matrixL().solve(unit(m));
    const Eigen::MatrixXd whole = root.matrixL().solve(Eigen::MatrixXd(half.transpose()));
    return Eigen::MatrixXd((whole + whole.transpose()) / 2);
  };
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(relative(equations.information));
  const Eigen::VectorXd& value = eigen.eigenvalues();
  Eigen::VectorXd spread = Eigen::VectorXd::Zero(value.size());
  for (const Eigen::MatrixXd& part : equations.information_parts) {
    const Eigen::MatrixXd in_part = eigen.eigenvectors().transpose() * relative(part) * eigen.eigenvectors();
    spread += (in_part.diagonal() - value / static_cast<double>(parts)).cwiseAbs2();
  }
  const Eigen::VectorXd least = 3 * spread.cwiseSqrt();
  const Eigen::MatrixXd v = scale.asDiagonal() * l * eigen.eigenvectors();
  return {v * value.cwiseMax(least).asDiagonal() * v.transpose(), (value.array() > least.array()).all()};
}

}  // namespace itn
