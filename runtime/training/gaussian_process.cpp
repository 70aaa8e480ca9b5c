#include "runtime/training/gaussian_process.h"

#include <cmath>

namespace itn {

GaussianProcess::GaussianProcess(const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows)
    : kernel_(points, rows), noise_(rows.cols()), scale_(rows.cols()), left_out_(points.cols(), rows.cols()) {
  const Eigen::MatrixXd parts = kernel_.parts(rows);
  precision_.resize(parts.rows(), parts.cols());
  for (Eigen::Index j = 0; j < parts.cols(); ++j) {
    noise_[j] = kernel_.likeliest_noise(parts.col(j));
    precision_.col(j) = (kernel_.variances().array() + noise_[j]).inverse();
  }
  weighted_ = precision_.cwiseProduct(parts);
  scale_ = parts.cwiseProduct(weighted_).colwise().mean().cwiseMax(1e-12).transpose();
  for (Eigen::Index k = 0; k < points.cols(); ++k)
    for (Eigen::Index j = 0; j < parts.cols(); ++j)
      left_out_(k, j) = kernel_.left_out(k, noise_[j], parts.col(j))(0, 0) /
                        std::sqrt(scale_[j] * kernel_.left_out_covariance(k, noise_[j])(0, 0));
}

GaussianProcess::Prediction GaussianProcess::at(const Eigen::VectorXd& point) const {
  const Eigen::VectorXd covariance = kernel_.covariances(point, 1).transpose();
  const Eigen::ArrayXd told = precision_.transpose() * covariance.cwiseAbs2();
  return {weighted_.transpose() * covariance,
          scale_.array() * (noise_.array() + (kernel_.variance(point) - told).max(0))};
}

}  // namespace itn
