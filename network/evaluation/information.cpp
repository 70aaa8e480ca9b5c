#include "network/evaluation/information.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

namespace itn {

void FisherInformation::add(const Rendering& rendering) {
  const auto parameters = static_cast<Eigen::Index>(rendering.derivatives.size());
  const auto pixels = static_cast<Eigen::Index>(rendering.stderr_.size());
  if (count_ == 0) {
    sum_.setZero(parameters, pixels);
    squares_.setZero(parameters * parameters, pixels);
    variance_.setZero(pixels);
  }
  ++count_;
  Eigen::VectorXd one(parameters);
  for (Eigen::Index i = 0; i < pixels; ++i) {
    const auto at = static_cast<std::size_t>(i);
    for (Eigen::Index p = 0; p < parameters; ++p)
      one[p] = static_cast<double>(rendering.derivatives[static_cast<std::size_t>(p)].mean[at]);
    sum_.col(i) += one;
    squares_.col(i) += (one * one.transpose()).reshaped();
    variance_[i] += std::pow(static_cast<double>(rendering.stderr_[at]), 2) * rendering.spp;
  }
}

void FisherInformation::add(const FisherInformation& other) {
  count_ += other.count_;
  sum_ += other.sum_;
  squares_ += other.squares_;
  variance_ += other.variance_;
}

Eigen::MatrixXd FisherInformation::of_image(int spp) const {
  const auto count = static_cast<double>(count_);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(sum_.rows(), sum_.rows());
  for (Eigen::Index i = 0; i < sum_.cols(); ++i) {
    if (!(variance_[i] > 0)) continue;
    const double variance = variance_[i] / count / spp;
    information += (sum_.col(i) * sum_.col(i).transpose() - squares_.col(i).reshaped(sum_.rows(), sum_.rows())) /
                   (count * (count - 1) * variance);
  }
  return information;
}

bool agree(const Bound& a, const Bound& b) {
  const Eigen::ArrayXd ratio = a.with_prior.array() / b.with_prior.array();
  return (ratio < 2.25).all() && (ratio > 1 / 2.25).all();
}

Bound cramer_rao(const Eigen::MatrixXd& information, const Eigen::VectorXd& prior) {
  // In units of the prior, where its information is the identity.
  const Eigen::VectorXd unit = prior.cwiseSqrt();
  const Eigen::MatrixXd relative = unit.asDiagonal() * information * unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(relative);
  const Eigen::ArrayXd value = eigen.eigenvalues().array();
  const Eigen::MatrixXd square = eigen.eigenvectors().cwiseAbs2();
  Bound bound;
  if ((value > 0).all())
    bound.image = prior.cwiseProduct(square * value.inverse().matrix());
  else
    bound.image = Eigen::VectorXd::Constant(prior.size(), std::numeric_limits<double>::infinity());
  bound.with_prior = prior.cwiseProduct(square * (1 + value.max(0.0)).inverse().matrix());
  return bound;
}

}  // namespace itn
