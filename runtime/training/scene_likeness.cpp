#include "runtime/training/scene_likeness.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/inversion/smoothing.h"

namespace itn {
namespace {

constexpr std::array<int, 3> radii{0, 1, 3};  // of the squares
constexpr int most_steps = 20;

// Quantile of Student's distribution with 10 degrees of freedom or more, to a hundredth, from that of the normal one
// (Abramowitz and Stegun 1964, 26.7.5).
double student_quantile(double z, double freedom) {
  const double z2 = z * z;
  return z * (1 + (z2 + 1) / (4 * freedom) + (5 * z2 * z2 + 16 * z2 + 3) / (96 * freedom * freedom) +
              (3 * z2 * z2 * z2 + 19 * z2 * z2 + 17 * z2 - 15) / (384 * freedom * freedom * freedom));
}

}  // namespace

SceneLikeness::SceneLikeness(const MaterialKernel& kernel, const ImageRows& images, const Eigen::VectorXf& noise,
                             Eigen::Index width)
    : kernel_(kernel), width_(width), noise_(noise.cast<double>().transpose()) {
  const Eigen::Index block = 1 + kernel.dimensions(), count = images.rows() / block;
  exemplars_ = static_cast<double>(count);
  Eigen::MatrixXd rows = images.cast<double>();
  mean_ = Eigen::RowVectorXd::Zero(rows.cols());
  for (Eigen::Index k = 0; k < count; ++k) mean_ += rows.row(block * k) / exemplars_;
  for (Eigen::Index k = 0; k < count; ++k) rows.row(block * k) -= mean_;
  const Eigen::MatrixXd parts = kernel.parts(rows * noise_.cwiseInverse().asDiagonal());
  emulated_noise_ = kernel.likeliest_noise(parts);
  weighted_ = (kernel.variances().array() + emulated_noise_).inverse().matrix().asDiagonal() * parts;

  Eigen::ArrayXd log_variance(count);
  Eigen::Array<double, Eigen::Dynamic, scales> sizes(count, scales);
  for (Eigen::Index k = 0; k < count; ++k) {
    const MaterialKernel::LeftOut left_out = kernel.left_out(k, emulated_noise_, parts);
    Eigen::VectorXd left = left_out.errors.transpose();
    // Of a photo the material that fits best is looked for, of an exemplar to first order.
    const Eigen::MatrixXd slopes =
        (kernel.covariances(kernel.material(k), block) * weighted_).bottomRows(block - 1).transpose();
    left -= slopes * slopes.colPivHouseholderQr().solve(left);
    sizes.row(k) = log_sizes(left.transpose());
    log_variance[k] = std::log(left_out.variance);
  }
  mean_log_variance_ = log_variance.mean();
  log_variance -= mean_log_variance_;
  spread_ = log_variance.square().sum() + 1e-9;
  height_ = sizes.colwise().mean();
  slope_ = ((sizes.colwise() * log_variance).colwise().sum() / spread_).max(0);
  sizes.rowwise() -= height_;
  sizes -= (log_variance.matrix() * slope_.matrix()).array();
  deviation_ = (sizes.square().colwise().sum() / (exemplars_ - 2)).sqrt().max(1e-6);
}

double SceneLikeness::doubt(const Eigen::RowVectorXf& photo, const Eigen::VectorXd& near) const {
  Eigen::VectorXd at = near;
  const Eigen::RowVectorXd image = (photo.cast<double>() - mean_).cwiseQuotient(noise_);
  const PerScale sizes = log_sizes(left_of(image, at));
  const Eigen::ArrayXd variance =
      kernel_.prediction_variances(at, kernel_.covariances(at, 1), Eigen::ArrayXd::Constant(1, emulated_noise_));
  const double from_mean = std::log(variance[0]) - mean_log_variance_;
  const double uncertainty = std::sqrt(1 + 1 / exemplars_ + from_mean * from_mean / spread_);
  return ((sizes - height_ - slope_ * from_mean) / (deviation_ * uncertainty)).maxCoeff();
}

double SceneLikeness::limit() const {
  constexpr double z = 2.7131;  // 1 - .01 / 3 of normal numbers are below
  return student_quantile(z, exemplars_ - 2);
}

// Beside what is emulated at the material that fits best (Levenberg and Marquardt), which is looked for from `at`, and
// which that becomes.
Eigen::RowVectorXd SceneLikeness::left_of(const Eigen::RowVectorXd& image, Eigen::VectorXd& at) const {
  Eigen::MatrixXd emulated = kernel_.covariances(at, 1 + at.size()) * weighted_;  // and its derivatives
  Eigen::RowVectorXd left = image - emulated.row(0);
  double damping = 1e-2;
  for (int step = 0; step < most_steps && damping < 1e6; ++step) {
    const Eigen::MatrixXd slopes = emulated.bottomRows(at.size());
    Eigen::MatrixXd normal = slopes * slopes.transpose();
    normal.diagonal() *= 1 + damping;
    const Eigen::VectorXd way = normal.ldlt().solve(slopes * left.transpose());
    const Eigen::VectorXd next = (at + way).cwiseMax(-1).cwiseMin(1);
    const Eigen::MatrixXd there = kernel_.covariances(next, 1 + at.size()) * weighted_;
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
    double sum = 1e-12;
    for (const double mean : smoothed(image, width, height, 1, radii[static_cast<std::size_t>(i)])) sum += mean * mean;
    result[i] = std::log(sum);
  }
  return result;
}

}  // namespace itn
