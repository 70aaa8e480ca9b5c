#include "network/prediction/material_kernel.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/inverse/posterior/low_discrepancy.h"

namespace itn {
namespace {

using Scales = MaterialKernel::Scales;

constexpr Eigen::Index candidates = 75;        // of scales
constexpr Eigen::Index most_by_evidence = 32;  // materials that choose among them, evenly of all
constexpr double least_noise = 1e-6, most_noise = 10;
constexpr int noises = 57;  // that are tried, a third apart

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
  using Point = Eigen::Ref<const Eigen::VectorXd>;

  Pair(const Scales& scales, const Point& a, const Point& b)
      : scales_(scales), a_(a), b_(b), z_((a - b).cwiseQuotient(scales.length)) {
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
  Point a_, b_;
  Eigen::VectorXd z_;  // their distance over the lengths
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
  return result;
}

double from_to(double share, double low, double high) { return low * std::pow(high / low, share); }

// Number k of those that are tried, evenly in the logarithms.
Scales candidate(Eigen::Index dimensions, Eigen::Index k) {
  const Eigen::VectorXd u = (low_discrepancy_point(dimensions + 2, static_cast<int>(k)).array() + 1) / 2;
  Scales scales{Eigen::VectorXd(dimensions), from_to(u[dimensions], 0.1, 100), from_to(u[dimensions + 1], 0.3, 30)};
  for (Eigen::Index i = 0; i < dimensions; ++i) scales.length[i] = from_to(u[i], 0.5, 6);
  return scales;
}

// Rows with the derivatives by the coordinates of materials' places, from those by the cube's.
Eigen::MatrixXd by_coordinates(Eigen::MatrixXd rows, const std::vector<MaterialPlace>& places) {
  Eigen::Index first = 0;  // row of a material
  for (const MaterialPlace& place : places) {
    const Eigen::Index d = place.at.size();
    rows.middleRows(first + 1, d) = place.by.transpose().partialPivLu().solve(rows.middleRows(first + 1, d).eval());
    first += 1 + d;
  }
  return rows;
}

struct Parts {
  Eigen::MatrixXd basis;      // rows to parts
  Eigen::VectorXd variances;  // of each, without noise
  double log_unit = 0;        // of the determinant of the noise's covariance, for noise of 1
};

// The eigenvectors of the covariance over that of the noise.
Parts taken_apart(const Scales& scales, const Eigen::MatrixXd& points) {
  Eigen::MatrixXd covariance = covariance_of_rows(scales, points);
  const Eigen::Index block = 1 + points.rows();
  Eigen::VectorXd unit(covariance.rows());
  for (Eigen::Index r = 0; r < unit.size(); ++r) unit[r] = r % block == 0 ? 1 : std::sqrt(scales.derivative_noise);
  const Eigen::VectorXd over = unit.cwiseInverse();
  covariance = over.asDiagonal() * covariance * over.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  return {over.asDiagonal() * eigen.eigenvectors(), eigen.eigenvalues().cwiseMax(0), 2 * unit.array().log().sum()};
}

// Of numbers, the likeliest of each.
struct Noises {
  Eigen::VectorXd variance, evidence;  // log evidence without its constant
};

// Each number with its best scale.
Noises likeliest_noises_of(const Eigen::VectorXd& variances, const Eigen::MatrixXd& parts) {
  const auto rows = static_cast<double>(parts.rows());
  const Eigen::MatrixXd squares = parts.cwiseAbs2();
  Noises best{Eigen::VectorXd(parts.cols()),
              Eigen::VectorXd::Constant(parts.cols(), -std::numeric_limits<double>::infinity())};
  for (int k = 0; k < noises; ++k) {
    const double noise = from_to(static_cast<double>(k) / (noises - 1), least_noise, most_noise);
    const Eigen::VectorXd all = variances.array() + noise;
    const double unit = all.array().log().sum();
    const Eigen::RowVectorXd scale = (all.cwiseInverse().transpose() * squares / rows).cwiseMax(1e-12);
    for (Eigen::Index j = 0; j < parts.cols(); ++j) {
      const double evidence = -0.5 * (rows * std::log(scale[j]) + unit);
      if (evidence <= best.evidence[j]) continue;
      best.variance[j] = noise;
      best.evidence[j] = evidence;
    }
  }
  return best;
}

// Log evidence of all columns, each with its best noise and scale.
double evidence(const Scales& scales, const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows) {
  const Parts apart = taken_apart(scales, points);
  const Noises found = likeliest_noises_of(apart.variances, apart.basis.transpose() * rows);
  return found.evidence.sum() - 0.5 * static_cast<double>(rows.cols()) * apart.log_unit;
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

MaterialKernel::MaterialKernel(const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows,
                               const MaterialCoordinates& coordinates)
    : coordinates_(coordinates), points_(points) {
  Eigen::MatrixXd at(points.rows(), points.cols());
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    places_.push_back(coordinates(points.col(k)));
    at.col(k) = places_.back().at;
  }
  scales_ = likeliest_scales(at, by_coordinates(rows, places_));
  Parts apart = taken_apart(scales_, at);
  basis_ = std::move(apart.basis);
  variances_ = std::move(apart.variances);
}

Eigen::MatrixXd MaterialKernel::parts(const Eigen::MatrixXd& rows) const {
  return basis_.transpose() * by_coordinates(rows, places_);
}

MaterialKernel::Covariances MaterialKernel::covariances(const Eigen::VectorXd& point, Eigen::Index count) const {
  const MaterialPlace place = coordinates_(point);
  const Eigen::Index block = 1 + points_.rows();
  Eigen::MatrixXd with_rows(count, basis_.rows());
  for (Eigen::Index k = 0; k < points_.cols(); ++k) {
    const Pair pair(scales_, place.at, places_[static_cast<std::size_t>(k)].at);
    for (Eigen::Index at = 0; at < count; ++at)
      for (Eigen::Index r = 0; r < block; ++r) with_rows(at, block * k + r) = pair.covariance(at, r);
  }
  Covariances result{with_rows * basis_, Pair(scales_, place.at, place.at).covariance(0, 0)};
  if (count > 1)
    result.with_parts.bottomRows(block - 1) = place.by.transpose() * result.with_parts.bottomRows(block - 1).eval();
  return result;
}

Eigen::VectorXd MaterialKernel::likeliest_noises(const Eigen::MatrixXd& parts) const {
  return likeliest_noises_of(variances_, parts).variance;
}

// In closed form: with P the material's block of the inverse of the rows' covariance C, the errors of its rows are P^-1
// times its rows of C^-1 y, and their covariance is P^-1.
MaterialKernel::LeftOut MaterialKernel::left_out(Eigen::Index material, double noise,
                                                 const Eigen::MatrixXd& parts) const {
  const Eigen::Index block = 1 + points_.rows();
  const Eigen::MatrixXd own = basis_.middleRows(block * material, block);
  const Eigen::MatrixXd weighted = own * (variances_.array() + noise).inverse().matrix().asDiagonal();
  const Eigen::MatrixXd covariance = (weighted * own.transpose()).inverse();
  const Eigen::RowVectorXd of_parts = covariance.row(0) * weighted;
  return {of_parts * parts, covariance(0, 0), noise * of_parts.squaredNorm()};
}

}  // namespace itn
