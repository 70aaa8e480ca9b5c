#include "network/prediction/gaussian_process.h"

#include <algorithm>
#include <map>
#include <utility>

namespace itn {

GaussianProcess::GaussianProcess(std::shared_ptr<const MaterialKernel> kernel, const Eigen::MatrixXd& rows)
    : kernel_(std::move(kernel)), scale_(rows.cols()) {
  weighted_ = kernel_->parts(rows);
  noise_ = kernel_->likeliest_noises(weighted_);
  std::map<double, std::vector<Eigen::Index>> of_noise;
  for (Eigen::Index j = 0; j < rows.cols(); ++j) of_noise[noise_[j]].push_back(j);
  for (auto& [noise, which] : of_noise) {
    alike_.push_back({noise, std::move(which), {}});
    Alike& some = alike_.back();
    some.parts = weighted_(Eigen::all, some.which);
  }
  const auto groups = static_cast<Eigen::Index>(alike_.size());
  told_.resize(groups, weighted_.rows());
  of_noise_.resize(groups, weighted_.rows());
  for (Eigen::Index i = 0; i < groups; ++i) {
    const double noise = alike_[static_cast<std::size_t>(i)].noise;
    told_.row(i) = (kernel_->variances().array() + noise).inverse();
    of_noise_.row(i) = noise * told_.row(i).cwiseAbs2();
  }
  for (Eigen::Index j = 0; j < rows.cols(); ++j) {
    const Eigen::VectorXd parts = weighted_.col(j);
    weighted_.col(j).array() /= kernel_->variances().array() + noise_[j];
    scale_[j] = std::max(1e-12, parts.cwiseProduct(weighted_.col(j)).mean());
    noise_[j] *= scale_[j];
  }
}

GaussianProcess::Numbers GaussianProcess::at(const Eigen::VectorXd& point) const {
  const MaterialKernel::Covariances of_value = kernel_->covariances(point, 1);
  Numbers told{weighted_.transpose() * of_value.with_parts.transpose(), Eigen::VectorXd(noise_.size()),
               Eigen::VectorXd(noise_.size())};
  const Eigen::VectorXd squares = of_value.with_parts.row(0).cwiseAbs2().transpose();
  const Eigen::VectorXd known = told_ * squares, of_noise = of_noise_ * squares;
  for (Eigen::Index i = 0; i < known.size(); ++i)
    set_variances(told, alike_[static_cast<std::size_t>(i)], std::max(of_noise[i], of_value.own - known[i]),
                  of_noise[i]);
  return told;
}

Eigen::MatrixXd GaussianProcess::with_derivatives(const Eigen::VectorXd& point) const {
  return kernel_->covariances(point, 1 + point.size()).with_parts * weighted_;
}

GaussianProcess::Numbers GaussianProcess::left_out(Eigen::Index material) const {
  Numbers left{Eigen::VectorXd(noise_.size()), Eigen::VectorXd(noise_.size()), Eigen::VectorXd(noise_.size())};
  for (const Alike& some : alike_) {
    const MaterialKernel::LeftOut of_some = kernel_->left_out(material, some.noise, some.parts);
    left.value(some.which) = of_some.errors.transpose();
    set_variances(left, some, of_some.variance, of_some.of_noise);
  }
  return left;
}

void GaussianProcess::set_variances(Numbers& numbers, const Alike& alike, double variance, double of_noise) const {
  for (const Eigen::Index j : alike.which) {
    numbers.variance[j] = scale_[j] * variance;
    numbers.of_noise[j] = scale_[j] * of_noise;
  }
}

}  // namespace itn
