#include "runtime/training/gaussian_process.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/inversion/posterior/low_discrepancy.h"

namespace itn {
namespace {

using Scales = GaussianProcess::Scales;

constexpr Eigen::Index candidates = 150;       // of scales
constexpr Eigen::Index most_by_evidence = 48;  // materials that choose among them, evenly of all

// The n-th derivative of exp(-z^2 / 2) over that: a Hermite polynomial.
double hermite(int n, double z) {
  double before = 0, polynomial = 1;  // He_n, with (-1)^n
  for (int k = 0; k < n; ++k) {
    const double next = -z * polynomial - k * before;
    before = polynomial;
    polynomial = next;
  }
  return polynomial;
}

// The covariances of a number at two materials: of values (row 0), and of derivatives by coordinate row - 1.
class Pair {
 public:
  Pair(const Scales& scales, Eigen::VectorXd a, Eigen::VectorXd b)
      : scales_(scales), a_(std::move(a)), b_(std::move(b)), z_((a_ - b_).cwiseQuotient(scales.length)) {
    gaussian_ = std::exp(-z_.squaredNorm() / 2);
  }

  double covariance(Eigen::Index a_row, Eigen::Index b_row) const {
    double product = b_row > 0 ? -gaussian_ : gaussian_;
    for (const Eigen::Index row : {a_row, b_row}) {
      if (row == 0) continue;
      product /= scales_.length[row - 1];
      if (a_row != b_row) product *= hermite(1, z_[row - 1]);
    }
    if (a_row > 0 && a_row == b_row) product *= hermite(2, z_[a_row - 1]);
    double linear = 0;
    if (a_row == 0 && b_row == 0) linear = 1 + a_.dot(b_);
    if (a_row > 0 && b_row == 0) linear = b_[a_row - 1];
    if (a_row == 0 && b_row > 0) linear = a_[b_row - 1];
    if (a_row > 0 && a_row == b_row) linear = 1;
    return product + scales_.linear * linear;
  }

 private:
  const Scales& scales_;
  Eigen::VectorXd a_, b_, z_;  // z: their distance over the lengths
  double gaussian_;
};

Eigen::MatrixXd covariance_of_rows(const Scales& scales, const Eigen::MatrixXd& points) {
  const Eigen::Index block = 1 + points.rows(), count = points.cols();
  Eigen::MatrixXd result(block * count, block * count);
  for (Eigen::Index b = 0; b < count; ++b)
    for (Eigen::Index a = b; a < count; ++a) {
      const Pair pair(scales, points.col(a), points.col(b));
      for (Eigen::Index r = 0; r < block; ++r)
        for (Eigen::Index c = 0; c < block; ++c)
          result(block * a + r, block * b + c) = result(block * b + c, block * a + r) = pair.covariance(r, c);
    }
  for (Eigen::Index r = 0; r < result.rows(); ++r)
    result(r, r) += r % block == 0 ? scales.value_noise : scales.derivative_noise;
  return result;
}

double from_to(double share, double low, double high) { return low * std::pow(high / low, share); }

// Number k of those that are tried, evenly in the logarithms.
Scales candidate(Eigen::Index dimensions, Eigen::Index k) {
  const Eigen::VectorXd u = (low_discrepancy_point(dimensions + 3, static_cast<int>(k)).array() + 1) / 2;
  Scales scales{Eigen::VectorXd(dimensions), from_to(u[dimensions], 0.1, 100), from_to(u[dimensions + 1], 1e-5, 1), 0};
  for (Eigen::Index i = 0; i < dimensions; ++i) scales.length[i] = from_to(u[i], 0.5, 6);
  scales.derivative_noise = scales.value_noise * from_to(u[dimensions + 2], 0.3, 30);
  return scales;
}

// Of each column of the rows, y^T C^-1 y over their number: what its variances are over the kernel's.
Eigen::VectorXd scale_of(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& weighted) {
  return (rows.cwiseProduct(weighted).colwise().mean()).cwiseMax(1e-12).transpose();
}

// Log evidence of all columns, each with its best scale, without its constant.
double evidence(const Scales& scales, const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows) {
  const Eigen::LLT<Eigen::MatrixXd> root(covariance_of_rows(scales, points));
  const double log_determinant = 2 * root.matrixLLT().diagonal().array().log().sum();
  const Eigen::VectorXd scale = scale_of(rows, root.solve(rows));
  return -0.5 * (static_cast<double>(rows.rows()) * scale.array().log().sum() +
                 static_cast<double>(rows.cols()) * log_determinant);
}

Scales likeliest_scales(const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows) {
  const Eigen::Index block = 1 + points.rows(), count = std::min(most_by_evidence, points.cols());
  Eigen::MatrixXd some(points.rows(), count), of_some(block * count, rows.cols());
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index from = k * points.cols() / count;
    some.col(k) = points.col(from);
    of_some.middleRows(block * k, block) = rows.middleRows(block * from, block);
  }
  std::vector<double> found(candidates);
  parallel_for(candidates, [&](Eigen::Index k) {
    found[static_cast<std::size_t>(k)] = evidence(candidate(points.rows(), k), some, of_some);
  });
  return candidate(points.rows(), std::max_element(found.begin(), found.end()) - found.begin());
}

}  // namespace

GaussianProcess::GaussianProcess(const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows)
    : points_(points), scales_(likeliest_scales(points, rows)) {
  const Eigen::LLT<Eigen::MatrixXd> root(covariance_of_rows(scales_, points));
  precision_ = root.solve(Eigen::MatrixXd::Identity(rows.rows(), rows.rows()));
  weighted_ = precision_ * rows;
  scale_ = scale_of(rows, weighted_);
  const Eigen::Index block = 1 + points.rows();
  left_out_.resize(points.cols(), rows.cols());
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const Eigen::MatrixXd open = left_out_covariance(k);
    left_out_.row(k) = open.row(0) * weighted_.middleRows(block * k, block) / std::sqrt(open(0, 0));
  }
}

// In closed form: with P the material's block of the precision the errors are P^-1 (C^-1 y), of covariance P^-1.
Eigen::MatrixXd GaussianProcess::left_out_covariance(Eigen::Index material) const {
  const Eigen::Index block = 1 + points_.rows();
  return precision_.block(block * material, block * material, block, block).inverse();
}

Eigen::MatrixXd GaussianProcess::covariances(const Eigen::VectorXd& point) const {
  const Eigen::Index block = 1 + points_.rows();
  Eigen::MatrixXd result(block, precision_.rows());
  for (Eigen::Index k = 0; k < points_.cols(); ++k) {
    const Pair pair(scales_, point, points_.col(k));
    for (Eigen::Index at = 0; at < block; ++at)
      for (Eigen::Index r = 0; r < block; ++r) result(at, block * k + r) = pair.covariance(at, r);
  }
  return result;
}

GaussianProcess::Prediction GaussianProcess::at(const Eigen::VectorXd& point) const {
  const Eigen::Index block = 1 + points_.rows();
  Eigen::VectorXd with_rows(precision_.rows());
  for (Eigen::Index k = 0; k < points_.cols(); ++k) {
    const Pair pair(scales_, point, points_.col(k));
    for (Eigen::Index r = 0; r < block; ++r) with_rows[block * k + r] = pair.covariance(0, r);
  }
  const double alone = Pair(scales_, point, point).covariance(0, 0);
  return {weighted_.transpose() * with_rows,
          scales_.value_noise +
              std::max(0.0, alone - with_rows.dot(precision_.selfadjointView<Eigen::Lower>() * with_rows))};
}

}  // namespace itn
