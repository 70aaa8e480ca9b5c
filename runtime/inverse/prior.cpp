#include "runtime/inverse/prior.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "runtime/base/statistics.h"

namespace itn {

void Prior::make_room(std::size_t coordinates) {
  if (mean.size() == coordinates) return;
  const auto n = static_cast<Eigen::Index>(coordinates);
  mean.assign(coordinates, 0);
  precision = Eigen::MatrixXd::Zero(n, n);
}

void Prior::add_interval(const std::vector<Coordinate>& coordinates, std::size_t i, double low, double high) {
  make_room(coordinates.size());
  const double from = coordinates[i].of(low), to = coordinates[i].of(high);
  const auto k = static_cast<Eigen::Index>(i);
  mean[i] = (from + to) / 2;
  precision(k, k) = std::pow(2 * normal_quantile(0.975) / (to - from), 2);
}

void Prior::add_samples(const std::vector<Coordinate>& coordinates, const std::vector<std::size_t>& which,
                        const std::vector<std::vector<double>>& samples) {
  make_room(coordinates.size());
  const auto n = static_cast<Eigen::Index>(which.size()), count = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd x(n, count);
  for (Eigen::Index s = 0; s < count; ++s)
    for (Eigen::Index p = 0; p < n; ++p) {
      const auto i = static_cast<std::size_t>(p);
      x(p, s) = coordinates[which[i]].of(samples[static_cast<std::size_t>(s)][i]);
    }
  const Eigen::VectorXd centre = x.rowwise().mean();
  x.colwise() -= centre;
  const Eigen::MatrixXd covariance = x * x.transpose() / static_cast<double>(count - 1);
  const Eigen::MatrixXd inverse = Eigen::LLT<Eigen::MatrixXd>(covariance).solve(Eigen::MatrixXd::Identity(n, n));
  for (Eigen::Index p = 0; p < n; ++p) {
    const std::size_t i = which[static_cast<std::size_t>(p)];
    mean[i] = centre[p];
    for (Eigen::Index q = 0; q < n; ++q)
      precision(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(which[static_cast<std::size_t>(q)])) =
          inverse(p, q);
  }
}

}  // namespace itn
