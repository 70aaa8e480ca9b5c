#include "network/prediction/answer_emulator.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "runtime/base/error.h"
#include "runtime/inverse/posterior/sampler.h"

namespace itn {
namespace {

constexpr double least_variance = 1e-6;
constexpr double seen_correlation = 4;  // exemplars a statistic, of which one sees half of a correlation

// Of the statistics' errors over what the process says of each, as the exemplars show them: no less than that, and of
// few exemplars less correlated.
Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& errors) {
  const auto count = static_cast<double>(errors.rows());
  const Eigen::MatrixXd products = errors.transpose() * errors / count;
  const Eigen::VectorXd seen = products.diagonal().cwiseMax(least_variance).cwiseSqrt();
  const Eigen::VectorXd deviation = seen.cwiseMax(1);
  const Eigen::VectorXd unit = deviation.cwiseQuotient(seen);
  Eigen::MatrixXd covariance = unit.asDiagonal() * products * unit.asDiagonal();
  covariance *= count / (count + seen_correlation * static_cast<double>(errors.cols()));
  covariance.diagonal() = deviation.cwiseAbs2();
  return covariance;
}

}  // namespace

void require_exemplars(Eigen::Index count) {
  if (count < least_exemplars || count > most_exemplars)
    throw UsageError(fmt::format("exemplars: got {}, need {} to {}", count, least_exemplars, most_exemplars));
}

AnswerEmulator::AnswerEmulator(const Eigen::MatrixXd& points, const Eigen::MatrixXd& answers,
                               const MaterialCoordinates& coordinates)
    : exemplars_(points.cols()) {
  if (exemplars_ < least_exemplars)
    throw UsageError(fmt::format("{} exemplars, need at least {}", exemplars_, least_exemplars));
  const auto of_values = Eigen::seqN(0, exemplars_, 1 + points.rows());
  Eigen::MatrixXd values = answers(of_values, Eigen::all);
  mean_ = values.colwise().mean().transpose();
  values.rowwise() -= mean_.transpose();
  deviation_ = values.cwiseAbs2().colwise().mean().cwiseSqrt().cwiseMax(1e-12).transpose();
  Eigen::MatrixXd rows = answers;
  rows(of_values, Eigen::all) = values;
  rows *= deviation_.cwiseInverse().asDiagonal();
  process_.emplace(std::make_shared<const MaterialKernel>(points, rows, coordinates), rows);
  Eigen::MatrixXd errors(exemplars_, rows.cols());  // over what the process says of them
  for (Eigen::Index k = 0; k < exemplars_; ++k) {
    const GaussianProcess::Numbers left = process_->left_out(k);
    errors.row(k) = left.value.cwiseQuotient(left.variance.cwiseSqrt());
  }
  const Eigen::LLT<Eigen::MatrixXd> root(covariance_of(errors));
  root_ = root.matrixL().solve(Eigen::MatrixXd::Identity(answers.cols(), answers.cols()));
}

double AnswerEmulator::log_likelihood(const Eigen::VectorXd& answer, const Eigen::VectorXd& point) const {
  const GaussianProcess::Numbers told = process_->at(point);
  const Eigen::VectorXd variance = told.variance + process_->noise();
  const Eigen::VectorXd error = (answer - mean_).cwiseQuotient(deviation_) - told.value;
  const double square = (root_ * error.cwiseQuotient(variance.cwiseSqrt())).squaredNorm();
  const auto count = static_cast<double>(exemplars_);
  return -count / 2 * std::log1p(square / (count - 1)) - variance.array().log().sum() / 2;
}

Eigen::MatrixXd AnswerEmulator::posterior(const Eigen::VectorXd& answer, int count, std::uint64_t seed) const {
  SamplerOptions how;
  how.samples = count;
  how.seed = seed;
  const auto even = [](const Eigen::VectorXd&) { return 0.0; };
  const auto likelihood = [&](const Eigen::VectorXd& point) { return log_likelihood(answer, point); };
  return sample_posterior(Frame::whole(process_->kernel()->dimensions()), even, likelihood, how).at;
}

}  // namespace itn
