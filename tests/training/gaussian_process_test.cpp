// Gaussian processes of values and derivatives, where the function is known.
#include "runtime/training/gaussian_process.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "runtime/inversion/posterior/low_discrepancy.h"

using namespace itn;

namespace {

// Two numbers that bend with both coordinates.
Eigen::VectorXd curves(const Eigen::VectorXd& t) {
  Eigen::VectorXd result(2);
  result << std::sin(2 * t[0] + 0.5 * t[1]), std::exp(0.5 * t[0]) * (t[1] - 0.3 * t[0] * t[1]) - 0.5;
  return result;
}

// Values, and derivatives by central differences, with noise of a standard deviation.
struct Known {
  Eigen::MatrixXd points, rows;

  Known(int count, double noise = 0) : points(2, count), rows(3 * count, 2) {
    constexpr double h = 1e-5;
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal(0, noise);
    for (int k = 0; k < count; ++k) {
      points.col(k) = low_discrepancy_point(2, k);
      rows.row(3 * k) = curves(points.col(k));
      for (int i = 0; i < 2; ++i) {
        const Eigen::VectorXd way = h * Eigen::VectorXd::Unit(2, i);
        rows.row(3 * k + 1 + i) = (curves(points.col(k) + way) - curves(points.col(k) - way)) / (2 * h);
      }
    }
    if (noise > 0) rows = rows.unaryExpr([&](double x) { return x + normal(random); });
  }
};

// Root mean square of the errors over the cube.
double error(const GaussianProcess& process) {
  double square = 0;
  for (int k = 0; k < 200; ++k) {
    const Eigen::VectorXd t = low_discrepancy_point(2, 1000 + k);
    square += (process.at(t).mean - curves(t)).squaredNorm() / 400;
  }
  return std::sqrt(square);
}

}  // namespace

TEST_CASE("a process goes through values and derivatives without noise, and follows the function between them") {
  const Known known(12);
  const GaussianProcess process(known.points, known.rows);
  constexpr double h = 1e-4;
  for (int k = 0; k < 12; ++k) {
    const Eigen::VectorXd t = known.points.col(k);
    CHECK((process.at(t).mean - known.rows.row(3 * k).transpose()).norm() < 1e-2);
    for (int i = 0; i < 2; ++i) {
      const Eigen::VectorXd way = h * Eigen::VectorXd::Unit(2, i);
      const Eigen::VectorXd slope = (process.at(t + way).mean - process.at(t - way).mean) / (2 * h);
      CHECK((slope - known.rows.row(3 * k + 1 + i).transpose()).norm() < 3e-2);
    }
  }
  CHECK(error(process) < 0.02);
}

TEST_CASE("a process tells other numbers of the same materials, and their derivatives") {
  const Known known(12);
  Eigen::MatrixXd rows = known.rows.rowwise().reverse();
  const GaussianProcess process(known.points, known.rows);
  const Eigen::MatrixXd weighted = process.weigh(rows);
  constexpr double h = 1e-4;
  for (int k = 0; k < 10; ++k) {
    const Eigen::VectorXd t = low_discrepancy_point(2, 1000 + k);
    const Eigen::MatrixXd said = process.covariances(t) * weighted;
    CHECK((said.row(0).reverse().transpose() - process.at(t).mean).norm() < 1e-6);
    for (int i = 0; i < 2; ++i) {
      const Eigen::VectorXd way = h * Eigen::VectorXd::Unit(2, i);
      const Eigen::MatrixXd slope = (process.covariances(t + way) - process.covariances(t - way)) * weighted / (2 * h);
      CHECK((said.row(1 + i) - slope.row(0)).norm() < 1e-3);
    }
  }
}

TEST_CASE("what a process says of its errors is what they are, at its points and between them") {
  const Known known(40, 0.1);
  const GaussianProcess process(known.points, known.rows);
  CHECK(error(process) < 0.06);  // the noise is averaged
  // 80 errors of variance about 1: 5 standard deviations of their mean square are 0.8.
  const double of_left_out =
      (process.left_out() * process.scale().cwiseSqrt().cwiseInverse().asDiagonal()).squaredNorm() / 80;
  CHECK(std::fabs(of_left_out - 1) < 0.8);
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal(0, 0.1);
  double square = 0;
  for (int k = 0; k < 200; ++k) {
    const Eigen::VectorXd t = low_discrepancy_point(2, 1000 + k);
    const GaussianProcess::Prediction said = process.at(t);
    for (Eigen::Index i = 0; i < 2; ++i)
      square += std::pow(curves(t)[i] + normal(random) - said.mean[i], 2) / (said.variance * process.scale()[i]) / 400;
  }
  CHECK(square > 0.4);
  CHECK(square < 2);
}
