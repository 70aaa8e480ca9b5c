#include "runtime/inverse/gauss_newton/normal_equations.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "itn/error.h"

namespace itn {
namespace {

constexpr double sure = 3;      // standard errors
constexpr double as_said = 10;  // values: what is left of few says little of their noise, which is then as it is said

// Compiled once: each product of another expression costs the compiler half a second and more.
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a * b; }
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, const Eigen::MatrixXd& c) {
  return product(product(a, b), c);
}
Eigen::MatrixXd scaled(const Eigen::MatrixXd& columns, const Eigen::ArrayXd& by) {
  return columns * by.matrix().asDiagonal();
}

}  // namespace

NormalEquations::NormalEquations(std::size_t unknowns) {
  const auto n = static_cast<Eigen::Index>(unknowns);
  right_ = Eigen::VectorXd::Zero(n);
  information_ = scale_ = spread_ = monte_carlo_ = Eigen::MatrixXd::Zero(n, n);
  information_noise_.assign(unknowns, scale_);
}

void NormalEquations::add(const LeastSquares& equations, const std::vector<double>& x) {
  count_ += 1;
  residuals_ = equations.residuals;
  information_ += equations.information;
  for (std::size_t k = 0; k < information_noise_.size(); ++k) information_noise_[k] += equations.information_noise[k];
  right_ += equations.information * Eigen::Map<const Eigen::VectorXd>(x.data(), right_.size()) - equations.gradient;
  scale_ += equations.scale;
  spread_ += equations.spread;
  monte_carlo_ += equations.monte_carlo;
}

double NormalEquations::Solution::distance(const std::vector<double>& from) const {
  const Eigen::VectorXd way = x - Eigen::Map<const Eigen::VectorXd>(from.data(), x.size());
  return std::sqrt(std::max(0.0, way.dot(Eigen::LDLT<Eigen::MatrixXd>(covariance).solve(way))) /
                   static_cast<double>(x.size()));
}

NormalEquations::Solution NormalEquations::solve(const std::vector<double>& from, const std::vector<std::string>& names,
                                                 const Prior& prior) const {
  for (Eigen::Index k = 0; k < scale_.rows(); ++k)
    if (!(scale_(k, k) > 0))
      throw ResultError(
          fmt::format("{}: no compared pixel depends on it, so the target cannot tell it; leave it out, "
                      "or show a part of the scene where it matters",
                      names[static_cast<std::size_t>(k)]));
  Solution solution;
  // Singular vectors where the scale is the identity; unit diagonal first, as the unknowns' scales differ.
  const Eigen::VectorXd unit = scale_.diagonal().cwiseSqrt();
  const auto in_units = [&](const Eigen::MatrixXd& m) {
    return Eigen::MatrixXd(unit.cwiseInverse().asDiagonal() * m * unit.cwiseInverse().asDiagonal());
  };
  constexpr double ridge = 1e-12;
  const Eigen::LLT<Eigen::MatrixXd> root(in_units(scale_) +
                                         ridge * Eigen::MatrixXd::Identity(unit.size(), unit.size()));
  const Eigen::MatrixXd l = unit.asDiagonal() * Eigen::MatrixXd(root.matrixL());
  const auto relative = [&](const Eigen::MatrixXd& m) {
    const Eigen::MatrixXd half = root.matrixL().solve(in_units(m));
    return Eigen::MatrixXd(root.matrixL().solve(Eigen::MatrixXd(half.transpose())).transpose());
  };

  // The targets' noise is the same in all equations, the rendering's is not.
  const auto unknowns = static_cast<double>(right_.size());
  const double free = std::max(0.0, residuals_ - unknowns);
  const Eigen::MatrixXd mean_monte_carlo = monte_carlo_ / count_;
  const Eigen::MatrixXd target_noise =
      (free * spread_ + as_said * scale_) / ((free + as_said) * count_) - mean_monte_carlo;
  // The mean gradient's variance over what the weights take it for.
  const double noise_ratio = count_ * relative(target_noise + mean_monte_carlo / count_).trace() / unknowns;
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(right_.size());
  Eigen::MatrixXd known = Eigen::MatrixXd::Zero(right_.size(), right_.size());
  const Eigen::Index parameters = prior.precision.rows();
  known.topLeftCorner(parameters, parameters) = count_ * noise_ratio * prior.precision;
  expected.head(parameters) = Eigen::Map<const Eigen::VectorXd>(prior.mean.data(), parameters);
  const Eigen::MatrixXd open = count_ * noise_ratio * known;  // known times the prior's covariance times known

  const Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner> svd(relative(information_),
                                                                         Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::ArrayXd value = svd.singularValues();
  const Eigen::MatrixXd l_inverse = l.inverse();
  const Eigen::MatrixXd right_axes = product(l_inverse.transpose(), svd.matrixV());
  Eigen::ArrayXd noise = Eigen::ArrayXd::Zero(value.size());
  for (std::size_t k = 0; k < information_noise_.size(); ++k) {
    const Eigen::MatrixXd along = product(svd.matrixU().transpose(), relative(information_noise_[k]), svd.matrixU());
    noise += along.diagonal().array() * right_axes.row(static_cast<Eigen::Index>(k)).transpose().array().square();
  }
  const Eigen::ArrayXd least = sure * noise.sqrt();
  // Along a direction that noise hides only the prior moves x: many steps by noise would be a random walk. Without a
  // prior they are at least short.
  constexpr double something = 1e-6;
  using Mask = Eigen::Array<bool, Eigen::Dynamic, 1>;
  const Eigen::ArrayXd by_known = product(svd.matrixV().transpose(), relative(known), svd.matrixV()).diagonal();
  const Mask told = value > least, by_prior = !told && by_known > something * value.maxCoeff();
  solution.hidden = !told.all();
  solution.determined = (told || by_prior).all();
  const auto filter = [&](const Mask& kept) {
    return product(scaled(product(l, svd.matrixU()), kept.cast<double>()), svd.matrixU().transpose(), l_inverse);
  };
  const Eigen::ArrayXd trusted = told.select(value, by_prior.select(0.0, least));
  solution.information = product(scaled(product(l, svd.matrixU()), trusted), svd.matrixV().transpose(), l.transpose());
  solution.information += known;

  const Eigen::PartialPivLU<Eigen::MatrixXd> solver(solution.information);
  const Eigen::VectorXd at = Eigen::Map<const Eigen::VectorXd>(from.data(), right_.size());
  const Eigen::MatrixXd not_by_prior = filter(!by_prior);
  solution.x = at + solver.solve(not_by_prior * (right_ - information_ * at) + known * (expected - at));
  const auto sandwich = [&](const Eigen::MatrixXd& m) {
    const Eigen::MatrixXd half = solver.solve(m);
    const Eigen::MatrixXd whole = solver.solve(Eigen::MatrixXd(half.transpose()));
    return Eigen::MatrixXd((whole + whole.transpose()) / 2);
  };
  const auto noise_of = [&](const Eigen::MatrixXd& m) {
    return sandwich(product(not_by_prior, m, not_by_prior.transpose()));
  };
  const Eigen::MatrixXd from_rendering = count_ * noise_of(mean_monte_carlo);
  const Eigen::MatrixXd from_target = count_ * count_ * noise_of(target_noise);
  // A small difference of two estimates may come out negative in some directions, which a covariance is not.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> positive(from_target);
  const Eigen::MatrixXd& axes = positive.eigenvectors();
  const Eigen::ArrayXd along_axes = positive.eigenvalues().cwiseMax(0.0);
  solution.covariance = product(scaled(axes, along_axes), axes.transpose()) + from_rendering + sandwich(open);
  solution.monte_carlo_share =
      Eigen::LDLT<Eigen::MatrixXd>(solution.covariance).solve(from_rendering).trace() / unknowns;
  return solution;
}

std::vector<double> NormalEquations::numbers() const {
  std::vector<double> result{count_, residuals_};
  const auto append = [&](const auto& m) { result.insert(result.end(), m.data(), m.data() + m.size()); };
  append(right_);
  append(information_);
  append(scale_);
  append(spread_);
  append(monte_carlo_);
  for (const Eigen::MatrixXd& each : information_noise_) append(each);
  return result;
}

NormalEquations NormalEquations::from_numbers(std::size_t unknowns, const std::vector<double>& numbers) {
  NormalEquations result(unknowns);
  if (numbers.size() != result.numbers().size()) throw std::invalid_argument("stored equations of another size");
  result.count_ = numbers[0];
  result.residuals_ = numbers[1];
  const double* next = numbers.data() + 2;
  const auto take = [&](auto& m) {
    std::copy_n(next, m.size(), m.data());
    next += m.size();
  };
  take(result.right_);
  take(result.information_);
  take(result.scale_);
  take(result.spread_);
  take(result.monte_carlo_);
  for (Eigen::MatrixXd& each : result.information_noise_) take(each);
  return result;
}

}  // namespace itn
