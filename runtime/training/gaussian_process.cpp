#include "runtime/training/gaussian_process.h"

#include <algorithm>
#include <cmath>

namespace itn {

GaussianProcess::GaussianProcess(const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows,
                                 const MaterialCoordinates& coordinates)
    : kernel_(points, rows, coordinates),
      noise_(rows.cols()),
      scale_(rows.cols()),
      left_out_(points.cols(), rows.cols()) {
  const Eigen::MatrixXd parts = kernel_.parts(rows);
  weighted_.resize(parts.rows(), parts.cols());
  for (Eigen::Index j = 0; j < parts.cols(); ++j) {
    noise_[j] = kernel_.likeliest_noise(parts.col(j));
    weighted_.col(j) = parts.col(j).array() / (kernel_.variances().array() + noise_[j]);
    scale_[j] = std::max(1e-12, parts.col(j).cwiseProduct(weighted_.col(j)).mean());
    for (Eigen::Index k = 0; k < points.cols(); ++k) {
      const MaterialKernel::LeftOut left = kernel_.left_out(k, noise_[j], parts.col(j));
      left_out_(k, j) = left.errors[0] / std::sqrt(scale_[j] * left.variance);
    }
  }
}

GaussianProcess::Prediction GaussianProcess::at(const Eigen::VectorXd& point) const {
  const Eigen::RowVectorXd with_parts = kernel_.covariances(point, 1);
  return {weighted_.transpose() * with_parts.transpose(),
          scale_.array() * kernel_.prediction_variances(point, with_parts, noise_)};
}

}  // namespace itn
