#include "tools/evaluation/information.h"

#include <Eigen/Eigenvalues>
#include <limits>

namespace itn {

Eigen::MatrixXd fisher_information(const std::vector<Rendering>& groups, std::span<const float> error) {
  const auto parameters = static_cast<Eigen::Index>(groups.front().derivatives.size());
  const auto count = static_cast<double>(groups.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(parameters, parameters);
  Eigen::VectorXd one(parameters);
  for (std::size_t i = 0; i < error.size(); ++i) {
    if (!(error[i] > 0)) continue;
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(parameters);
    Eigen::MatrixXd same = Eigen::MatrixXd::Zero(parameters, parameters);
    for (const Rendering& group : groups) {
      for (Eigen::Index p = 0; p < parameters; ++p)
        one[p] = static_cast<double>(group.derivatives[static_cast<std::size_t>(p)].mean[i]);
      sum += one;
      same += one * one.transpose();
    }
    const double variance = static_cast<double>(error[i]) * static_cast<double>(error[i]);
    information += (sum * sum.transpose() - same) / (count * (count - 1) * variance);
  }
  return information;
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
