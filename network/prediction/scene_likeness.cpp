#include "network/prediction/scene_likeness.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/inverse/smoothing.h"

namespace itn {
namespace {

constexpr std::array<int, 3> radii{0, 1, 3};  // of the squares
constexpr int most_steps = 20;
constexpr float least_noise = 0.005F;  // of what is seen of a pixel
constexpr double least_size = 1e-12;   // of what is left: a scene without light has no noise
constexpr double least_scatter = 1e-3;

}  // namespace

Eigen::VectorXf SeenExemplars::noise() const {
  return (errors.cwiseAbs2().colwise().mean().transpose().array() + least_noise * least_noise).sqrt();
}

SceneLikeness::SceneLikeness(const std::shared_ptr<const MaterialKernel>& kernel, const SeenExemplars& exemplars,
                             Eigen::Index width)
    : width_(width), noise_(exemplars.noise().cast<double>().transpose()) {
  const Eigen::Index block = 1 + kernel->dimensions(), count = exemplars.errors.rows();
  exemplars_ = static_cast<double>(count);
  Eigen::MatrixXd rows = exemplars.images.cast<double>();
  mean_ = Eigen::RowVectorXd::Zero(rows.cols());
  for (Eigen::Index k = 0; k < count; ++k) mean_ += rows.row(block * k) / exemplars_;
  for (Eigen::Index k = 0; k < count; ++k) rows.row(block * k) -= mean_;
  process_.emplace(kernel, rows * noise_.cwiseInverse().asDiagonal());

  // What noise leaves is what the halves differ by.
  Eigen::ArrayXd levels(count);
  Eigen::Array<double, Eigen::Dynamic, scales> sizes(count, scales);
  for (Eigen::Index k = 0; k < count; ++k) {
    levels[k] = level_of(exemplars.errors.row(k));
    sizes.row(k) =
        log_sizes(exemplars.halves.row(block * k).cast<double>().cwiseQuotient(noise_)) - std::log(levels[k]);
  }
  exemplar_noise_ = levels.mean();
  noise_share_ = sizes.exp().colwise().mean();
  noise_scatter_ = ((sizes.rowwise() - sizes.colwise().mean()).square().colwise().sum() / (exemplars_ - 1))
                       .sqrt()
                       .max(least_scatter);

  std::vector<Unknown> unknown;
  for (Eigen::Index k = 0; k < count; ++k) {
    const GaussianProcess::Numbers left = process_->left_out(k);
    // Of a photo the material that fits best is looked for, of an exemplar to first order.
    const Eigen::MatrixXd slopes = process_->with_derivatives(kernel->material(k)).bottomRows(block - 1).transpose();
    sizes.row(k) = log_sizes((left.value - slopes * slopes.colPivHouseholderQr().solve(left.value)).transpose());
    unknown.push_back(
        {levels[k] * left.of_noise.sum() / process_->noise().sum(), (left.variance - left.of_noise).sum()});
  }
  for (Eigen::Index scale = 0; scale < scales; ++scale) learn_rest(scale, sizes.col(scale), unknown);
}

Eigen::VectorXd SceneLikeness::best_fit(const Eigen::RowVectorXf& photo, Eigen::VectorXd from) const {
  left_of((photo.cast<double>() - mean_).cwiseQuotient(noise_), from);
  return from;
}

double SceneLikeness::doubt(const Eigen::RowVectorXf& photo, const Eigen::RowVectorXf& errors,
                            const Eigen::VectorXd& from) const {
  Eigen::VectorXd at = from;
  const PerScale sizes = log_sizes(left_of((photo.cast<double>() - mean_).cwiseQuotient(noise_), at));
  const GaussianProcess::Numbers told = process_->at(at);
  const LogSizes of_right =
      expected({level_of(errors) + exemplar_noise_ * told.of_noise.sum() / process_->noise().sum(),
                (told.variance - told.of_noise).sum()});
  return ((sizes - of_right.mean) / of_right.deviation).maxCoeff();
}

SceneLikeness::LogSizes SceneLikeness::expected(const Unknown& unknown) const {
  const PerScale of_noise = noise_share_ * unknown.noise, of_rest = rest_share_ * unknown.rest;
  const PerScale part = of_rest / (of_noise + of_rest);
  return {(of_noise + of_rest).log(),
          ((part * rest_scatter_).square() * (1 + 1 / exemplars_) + ((1 - part) * noise_scatter_).square()).sqrt()};
}

// rest_share_ becomes what makes exemplars' sizes the expected ones in the mean.
void SceneLikeness::learn_rest(Eigen::Index scale, const Eigen::ArrayXd& log_sizes,
                               const std::vector<Unknown>& unknown) {
  constexpr double least = 1e-3, most = 1e3, largest_scatter = 2;
  double low = std::log(least), high = std::log(most);
  Eigen::ArrayXd above(log_sizes.size()), part(log_sizes.size());
  for (int step = 0; step < 50; ++step) {
    const double share = std::exp((low + high) / 2);
    for (Eigen::Index k = 0; k < above.size(); ++k) {
      const Unknown& u = unknown[static_cast<std::size_t>(k)];
      const double of_rest = share * u.rest, size = noise_share_[scale] * u.noise + of_rest;
      above[k] = log_sizes[k] - std::log(size);
      part[k] = of_rest / size;
    }
    (above.mean() > 0 ? low : high) = std::log(share);
  }
  rest_share_[scale] = std::exp(low);
  const double of_noise = ((1 - part) * noise_scatter_[scale]).square().sum();
  rest_scatter_[scale] =
      std::clamp(std::sqrt(std::max(0.0, above.square().sum() - of_noise) / part.square().sum()), 0.0, largest_scatter);
}

double SceneLikeness::level_of(const Eigen::RowVectorXf& errors) const {
  return errors.cast<double>().cwiseQuotient(noise_).squaredNorm() + least_size;
}

// By Levenberg and Marquardt.
Eigen::RowVectorXd SceneLikeness::left_of(const Eigen::RowVectorXd& image, Eigen::VectorXd& at) const {
  Eigen::MatrixXd emulated = process_->with_derivatives(at);
  Eigen::RowVectorXd left = image - emulated.row(0);
  double damping = 1e-2;
  for (int step = 0; step < most_steps && damping < 1e6; ++step) {
    const Eigen::MatrixXd slopes = emulated.bottomRows(at.size());
    Eigen::MatrixXd normal = slopes * slopes.transpose();
    normal.diagonal() *= 1 + damping;
    const Eigen::VectorXd way = normal.ldlt().solve(slopes * left.transpose());
    const Eigen::VectorXd next = (at + way).cwiseMax(-1).cwiseMin(1);
    const Eigen::MatrixXd there = process_->with_derivatives(next);
    const Eigen::RowVectorXd left_there = image - there.row(0);
    if (left_there.squaredNorm() < left.squaredNorm()) {
      at = next;
      emulated = there;
      left = left_there;
      damping /= 5;
    } else {
      damping *= 5;
    }
  }
  return left;
}

SceneLikeness::PerScale SceneLikeness::log_sizes(const Eigen::RowVectorXd& left) const {
  const std::vector<double> image(left.begin(), left.end());
  const int width = static_cast<int>(width_), height = static_cast<int>(left.size() / width_);
  PerScale result;
  for (Eigen::Index i = 0; i < scales; ++i) {
    double sum = least_size;
    for (const double mean : smoothed(image, width, height, 1, radii[static_cast<std::size_t>(i)])) sum += mean * mean;
    result[i] = std::log(sum);
  }
  return result;
}

}  // namespace itn
