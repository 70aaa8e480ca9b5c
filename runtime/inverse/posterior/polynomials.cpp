#include "runtime/inverse/posterior/polynomials.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

namespace itn {
namespace {

std::vector<std::vector<int>> powers_up_to(std::size_t dimensions, int degree) {
  std::vector<std::vector<int>> all;
  std::vector<int> power(dimensions, 0);
  const std::function<void(std::size_t, int)> fill = [&](std::size_t from, int left) {
    if (from + 1 == dimensions) {
      power[from] = left;
      all.push_back(power);
      return;
    }
    for (int k = left; k >= 0; --k) {
      power[from] = k;
      fill(from + 1, left - k);
    }
  };
  for (int sum = 0; sum <= degree; ++sum) fill(0, sum);
  return all;
}

}  // namespace

Frame Frame::whole(Eigen::Index dimensions) {
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(dimensions, dimensions);
  return {Eigen::VectorXd::Zero(dimensions), identity, identity};
}

Frame Frame::around(const Eigen::MatrixXd& points, double margin) {
  constexpr double least = 1e-4;  // half of a side
  const Eigen::VectorXd mean = points.rowwise().mean();
  const Eigen::MatrixXd centred = points.colwise() - mean;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(Eigen::MatrixXd(centred * centred.transpose()));
  const Eigen::MatrixXd& directions = eigen.eigenvectors();
  const Eigen::MatrixXd along = directions.transpose() * centred;
  const Eigen::VectorXd low = along.rowwise().minCoeff(), high = along.rowwise().maxCoeff();
  const Eigen::VectorXd half = (margin / 2 * (high - low)).cwiseMax(least);
  return {mean + directions * (low + high) / 2, directions * half.asDiagonal(),
          half.cwiseInverse().asDiagonal() * directions.transpose()};
}

Polynomials::Polynomials(Frame frame, int degree)
    : frame_(std::move(frame)),
      degree_(degree),
      powers_(powers_up_to(static_cast<std::size_t>(frame_.centre.size()), degree)) {}

int Polynomials::degree_for(Eigen::Index dimensions, Eigen::Index most) {
  double count = 1;
  int degree = 0;
  for (;; ++degree) {
    count *= static_cast<double>(dimensions + degree + 1) / (degree + 1);  // of degree + 1
    if (count > static_cast<double>(most) || degree >= 8) return std::max(2, degree);
  }
}

void Polynomials::evaluate(const Eigen::VectorXd& t, Eigen::VectorXd& values, Eigen::MatrixXd* by) const {
  const Eigen::VectorXd w = frame_.of(t);
  const Eigen::Index dimensions = w.size();
  Eigen::ArrayXXd legendre(degree_ + 1, dimensions), slope(degree_ + 1, dimensions);
  for (Eigen::Index i = 0; i < dimensions; ++i) {
    legendre(0, i) = 1;
    slope(0, i) = 0;
    for (int n = 0; n < degree_; ++n) {
      const double before = n > 0 ? legendre(n - 1, i) : 0, slope_before = n > 0 ? slope(n - 1, i) : 0;
      legendre(n + 1, i) = ((2 * n + 1) * w[i] * legendre(n, i) - n * before) / (n + 1);
      slope(n + 1, i) = ((2 * n + 1) * (legendre(n, i) + w[i] * slope(n, i)) - n * slope_before) / (n + 1);
    }
    for (int n = 0; n <= degree_; ++n) {
      const double norm = std::sqrt(2 * n + 1.0);
      legendre(n, i) *= norm;
      slope(n, i) *= norm;
    }
  }
  values.resize(size());
  if (by) by->resize(dimensions, size());
  Eigen::VectorXd by_w(dimensions);
  for (std::size_t k = 0; k < powers_.size(); ++k) {
    double product = 1;
    for (Eigen::Index i = 0; i < dimensions; ++i) product *= legendre(powers_[k][static_cast<std::size_t>(i)], i);
    const auto column = static_cast<Eigen::Index>(k);
    values[column] = product;
    if (!by) continue;
    for (Eigen::Index j = 0; j < dimensions; ++j) {
      double of = slope(powers_[k][static_cast<std::size_t>(j)], j);
      for (Eigen::Index i = 0; i < dimensions && of != 0; ++i)
        if (i != j) of *= legendre(powers_[k][static_cast<std::size_t>(i)], i);
      by_w[j] = of;
    }
    by->col(column) = frame_.inverse.transpose() * by_w;
  }
}

}  // namespace itn
