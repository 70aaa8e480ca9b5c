#include "tools/evaluation/information.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

namespace itn {

Eigen::MatrixXd fisher_information(const std::vector<Rendering>& groups, int spp) {
  const auto parameters = static_cast<Eigen::Index>(groups.front().derivatives.size());
  const auto count = static_cast<Eigen::Index>(groups.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(parameters, parameters);
  Eigen::MatrixXd derivative(parameters, count);
  Eigen::ArrayXd variance(count);
  for (std::size_t i = 0; i < groups.front().stderr_.size(); ++i) {
    for (Eigen::Index g = 0; g < count; ++g) {
      const Rendering& group = groups[static_cast<std::size_t>(g)];
      variance[g] = std::pow(static_cast<double>(group.stderr_[i]), 2) * group.spp / spp;
      for (Eigen::Index p = 0; p < parameters; ++p)
        derivative(p, g) = static_cast<double>(group.derivatives[static_cast<std::size_t>(p)].mean[i]);
    }
    const double sum = variance.sum();
    for (Eigen::Index a = 0; a < count; ++a)
      for (Eigen::Index b = 0; b < a; ++b) {
        const double others = (sum - variance[a] - variance[b]) / static_cast<double>(count - 2);
        if (!(others > 1e-9 * sum)) continue;
        const Eigen::MatrixXd product = derivative.col(a) * derivative.col(b).transpose();
        information += (product + product.transpose()) / others;
      }
  }
  return information / static_cast<double>(count * (count - 1));
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
