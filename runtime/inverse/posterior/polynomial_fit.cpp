#include "runtime/inverse/posterior/polynomial_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>

namespace itn {
namespace {

constexpr double wide = 100;  // the prior's standard deviation of the constant, over the values' root mean square

double rest_of(const Polynomials& polynomials, const Eigen::VectorXd& values) {
  const auto& powers = polynomials.powers();
  const auto degree_of = [](const std::vector<int>& p) { return std::accumulate(p.begin(), p.end(), 0); };
  const int highest = degree_of(powers.back());
  double sum = 0, count = 0;
  for (std::size_t k = powers.size(); k-- > 0 && degree_of(powers[k]) == highest; ++count)
    sum += std::pow(values[static_cast<Eigen::Index>(k)], 2);
  return sum / count;
}

// The regression for one choice of what the polynomial cannot follow.
class Regression {
 public:
  Regression(const DesignRows& design, const Eigen::VectorXd& values, const Eigen::VectorXd& noise, double lacking)
      : noise_(noise + lacking * lacking * design.rest) {
    const Eigen::MatrixXd weighted = noise_.cwiseInverse().asDiagonal() * design.rows;
    normal_ = design.rows.transpose() * weighted;
    right_ = weighted.transpose() * values;
    constant_ = noise_.array().log().sum() + values.cwiseAbs2().dot(noise_.cwiseInverse());
  }

  // Log evidence without its constant. deviation: of the coefficients before.
  double evidence(const Eigen::VectorXd& deviation) {
    const Eigen::LLT<Eigen::MatrixXd> root = solve(deviation);
    const Eigen::VectorXd half = root.matrixL().solve(deviation.cwiseProduct(right_));
    return -0.5 * (constant_ - half.squaredNorm() + 2 * root.matrixLLT().diagonal().array().log().sum());
  }

  Eigen::LLT<Eigen::MatrixXd> solve(const Eigen::VectorXd& deviation) const {
    Eigen::MatrixXd scaled = deviation.asDiagonal() * normal_ * deviation.asDiagonal();
    scaled.diagonal().array() += 1;
    return Eigen::LLT<Eigen::MatrixXd>(scaled);
  }

  const Eigen::VectorXd& noise() const { return noise_; }
  const Eigen::VectorXd& right() const { return right_; }

 private:
  Eigen::VectorXd noise_, right_;
  Eigen::MatrixXd normal_;
  double constant_ = 0;
};

}  // namespace

DesignRows::DesignRows(const Polynomials& polynomials, const std::vector<Eigen::VectorXd>& points)
    : block(1 + polynomials.frame().centre.size()) {
  rows.resize(block * static_cast<Eigen::Index>(points.size()), polynomials.size());
  rest.resize(rows.rows());
  Eigen::VectorXd values;
  Eigen::MatrixXd by;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto first = block * static_cast<Eigen::Index>(i);
    polynomials.evaluate(points[i], values, &by);
    rows.row(first) = values.transpose();
    rows.middleRows(first + 1, block - 1) = by;
    for (Eigen::Index r = first; r < first + block; ++r) rest[r] = rest_of(polynomials, rows.row(r).transpose());
  }
}

DesignPoint::DesignPoint(const Polynomials& polynomials, const Eigen::VectorXd& t) {
  polynomials.evaluate(t, values);
  rest = rest_of(polynomials, values);
}

PolynomialFit::PolynomialFit(const Polynomials& polynomials, const DesignRows& design, const Eigen::VectorXd& values,
                             const Eigen::VectorXd& noise) {
  constexpr std::array<double, 11> lacking{1e-3, 0.02, 0.06, 0.2, 0.6, 2, 6, 20, 60, 200, 600};
  const Eigen::Index dimensions = polynomials.frame().centre.size();
  double square = 0, count = 0;
  for (Eigen::Index r = 0; r < values.size(); r += design.block, ++count) square += values[r] * values[r];
  const double constant = wide * std::sqrt(square / count) + 1e-6;

  const auto deviation_of = [&](const Eigen::VectorXd& logs) {  // of s and the r_i
    Eigen::VectorXd deviation(polynomials.size());
    for (Eigen::Index k = 0; k < deviation.size(); ++k) {
      double sum = logs[0];
      for (Eigen::Index i = 0; i < dimensions; ++i)
        sum += polynomials.powers()[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)] * logs[1 + i];
      deviation[k] = k == 0 ? constant : std::exp(sum);
    }
    return deviation;
  };

  std::vector<std::unique_ptr<Regression>> regressions(lacking.size());
  const auto regression = [&](std::size_t k) -> Regression& {
    if (!regressions[k]) regressions[k] = std::make_unique<Regression>(design, values, noise, lacking[k]);
    return *regressions[k];
  };
  // From the middle, with steps to both sides of one number after the other, which get shorter.
  std::size_t chosen = 2;
  Eigen::VectorXd logs = Eigen::VectorXd::Constant(1 + dimensions, std::log(0.4));
  logs[0] = std::log(std::sqrt(square / count) + 1e-6);
  double best = regression(chosen).evidence(deviation_of(logs));
  const auto consider = [&](std::size_t k, const Eigen::VectorXd& candidate) {
    const double evidence = regression(k).evidence(deviation_of(candidate));
    if (!(evidence > best)) return false;
    best = evidence;
    chosen = k;
    logs = candidate;
    return true;
  };
  for (const double step : {1.0, 0.7, 0.4, 0.2}) {
    if (chosen + 1 < lacking.size() && !consider(chosen + 1, logs) && chosen > 0) consider(chosen - 1, logs);
    for (Eigen::Index i = 0; i < logs.size(); ++i)
      for (const double way : {step, -step}) {
        Eigen::VectorXd candidate = logs;
        candidate[i] += i == 0 ? 2 * way : way;
        if (i > 0) candidate[i] = std::clamp(candidate[i], std::log(0.01), 0.0);
        if (candidate[i] != logs[i] && consider(chosen, candidate)) break;
      }
  }
  scales_ = {std::exp(logs[0]), logs.tail(dimensions).array().exp(), lacking[chosen]};

  const Regression& end = regression(chosen);
  const Eigen::VectorXd deviation = deviation_of(logs);
  const Eigen::LLT<Eigen::MatrixXd> root = end.solve(deviation);
  coefficients_ = deviation.cwiseProduct(root.solve(deviation.cwiseProduct(end.right())));
  root_ = root.matrixL().solve(Eigen::MatrixXd(deviation.asDiagonal()));

  // Each rendering from the others, in closed form: with H the block of what the fit passes on, N that of the noise,
  // and r the residuals, the error is N (N - H)^-1 r and has the covariance N (N - H)^-1 N.
  left_out_.setZero(values.size() / design.block);
  for (Eigen::Index first = 0; first < values.size(); first += design.block) {
    const auto rows = design.rows.middleRows(first, design.block);
    const Eigen::MatrixXd half = root_ * rows.transpose();
    const Eigen::VectorXd own = end.noise().segment(first, design.block);
    const Eigen::MatrixXd open = Eigen::MatrixXd(own.asDiagonal()) - half.transpose() * half;
    const Eigen::PartialPivLU<Eigen::MatrixXd> solver(open);
    const Eigen::VectorXd residual = values.segment(first, design.block) - rows * coefficients_;
    const double error = own[0] * solver.solve(residual)[0];
    const double variance = own[0] * solver.solve(Eigen::MatrixXd(own.asDiagonal()))(0, 0);
    if (variance > 0) left_out_[first / design.block] = error / std::sqrt(variance);
  }
  leave_one_out_ = left_out_.squaredNorm() / count;
  inflation_ = std::max(1.0, leave_one_out_);
}

double PolynomialFit::variance(const DesignPoint& at) const {
  return inflation_ * ((root_.triangularView<Eigen::Lower>() * at.values).squaredNorm() +
                       scales_.lacking * scales_.lacking * at.rest);
}

}  // namespace itn
