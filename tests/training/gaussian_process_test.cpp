// Gaussian processes of values and derivatives, where the function is known.
#include "network/prediction/gaussian_process.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "runtime/inverse/posterior/low_discrepancy.h"

using namespace itn;

namespace {

// Two numbers that bend with both coordinates.
Eigen::VectorXd curves(const Eigen::VectorXd& t) {
  Eigen::VectorXd result(2);
  result << std::sin(2 * t[0] + 0.5 * t[1]), std::exp(0.5 * t[0]) * (t[1] - 0.3 * t[0] * t[1]) - 0.5;
  return result;
}

// Values, and derivatives by central differences, with noise of a standard deviation of each number.
struct Known {
  Eigen::MatrixXd points, rows;

  Known(int count, const Eigen::Vector2d& noise) : points(2, count), rows(3 * count, 2) {
    constexpr double h = 1e-5;
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    for (int k = 0; k < count; ++k) {
      points.col(k) = low_discrepancy_point(2, k);
      rows.row(3 * k) = curves(points.col(k));
      for (int i = 0; i < 2; ++i) {
        const Eigen::VectorXd way = h * Eigen::VectorXd::Unit(2, i);
        rows.row(3 * k + 1 + i) = (curves(points.col(k) + way) - curves(points.col(k) - way)) / (2 * h);
      }
    }
    for (auto row : rows.rowwise())
      for (Eigen::Index i = 0; i < 2; ++i) row[i] += noise[i] * normal(random);
  }
};

GaussianProcess process_of(const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows,
                           const MaterialCoordinates& coordinates = plain_place) {
  return {std::make_shared<const MaterialKernel>(points, rows, coordinates), rows};
}

// Root mean square of the errors over the cube.
double error(const GaussianProcess& process) {
  double square = 0;
  for (int k = 0; k < 200; ++k) {
    const Eigen::VectorXd t = low_discrepancy_point(2, 1000 + k);
    square += (process.at(t).value - curves(t)).squaredNorm() / 400;
  }
  return std::sqrt(square);
}

}  // namespace

TEST_CASE("a process goes through values and derivatives without noise, and follows the function between them") {
  const Known known(12, Eigen::Vector2d::Zero());
  const GaussianProcess process = process_of(known.points, known.rows);
  constexpr double h = 1e-4;
  for (int k = 0; k < 12; ++k) {
    const Eigen::VectorXd t = known.points.col(k);
    const Eigen::MatrixXd said = process.with_derivatives(t);
    CHECK((said - known.rows.middleRows(3 * k, 3)).norm() < 5e-2);
    CHECK((said.row(0).transpose() - process.at(t).value).norm() < 1e-9);
    for (int i = 0; i < 2; ++i) {
      const Eigen::VectorXd way = h * Eigen::VectorXd::Unit(2, i);
      const Eigen::VectorXd slope = (process.at(t + way).value - process.at(t - way).value) / (2 * h);
      CHECK((slope - said.row(1 + i).transpose()).norm() < 1e-4);
    }
  }
  CHECK(error(process) < 0.02);
}

TEST_CASE(
    "what a process says of its errors is what they are for numbers of any noise, at its points and between them") {
  const Eigen::Vector2d noise(0.1, 0.01);
  const Known known(40, noise);
  const GaussianProcess process = process_of(known.points, known.rows);
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  Eigen::Vector2d square = Eigen::Vector2d::Zero(), error = square;
  for (int k = 0; k < 200; ++k) {
    const Eigen::VectorXd t = low_discrepancy_point(2, 1000 + k), truth = curves(t);
    const GaussianProcess::Numbers said = process.at(t);
    for (Eigen::Index i = 0; i < 2; ++i) {
      error[i] += std::pow(truth[i] - said.value[i], 2) / 200;
      square[i] += std::pow(truth[i] + noise[i] * normal(random) - said.value[i], 2) /
                   (said.variance[i] + process.noise()[i]) / 200;
      CHECK(said.of_noise[i] <= said.variance[i]);
    }
  }
  Eigen::Vector2d left_out = Eigen::Vector2d::Zero();
  for (Eigen::Index k = 0; k < 40; ++k) {
    const GaussianProcess::Numbers left = process.left_out(k);
    left_out += left.value.cwiseAbs2().cwiseQuotient(left.variance) / 40;
  }
  for (Eigen::Index i = 0; i < 2; ++i) {
    INFO("number " << i);
    CHECK(std::sqrt(process.noise()[i]) == Approx(noise[i]).epsilon(0.5));
    CHECK(std::sqrt(error[i]) < 0.6 * noise[i]);  // the noise is averaged
    CHECK(square[i] > 0.4);
    CHECK(square[i] < 2);
    // 40 errors of variance 1: 5 standard deviations of their mean square are 1.1.
    CHECK(std::fabs(left_out[i] - 1) < 1.1);
  }
}

TEST_CASE("what a process does not know at a point is what all known rows leave") {
  const Known known(12, Eigen::Vector2d(0.1, 0.01));
  const GaussianProcess process = process_of(known.points, known.rows);
  const MaterialKernel& kernel = *process.kernel();
  const Eigen::Index rows = known.rows.rows();
  // Covariances of the rows, and of noise of 1, as the kernel's parts say them.
  const Eigen::MatrixXd basis = kernel.parts(Eigen::MatrixXd::Identity(rows, rows)).transpose();
  const Eigen::MatrixXd of_noise = (basis * basis.transpose()).inverse();
  const Eigen::MatrixXd root = basis.inverse();
  const Eigen::MatrixXd covariance = root.transpose() * kernel.variances().asDiagonal() * root;
  const Eigen::VectorXd noise = kernel.likeliest_noises(kernel.parts(known.rows));
  for (int k = 0; k < 5; ++k) {
    const Eigen::VectorXd t = low_discrepancy_point(2, 1000 + k);
    const MaterialKernel::Covariances at = kernel.covariances(t, 1);
    const Eigen::VectorXd with = root.transpose() * at.with_parts.row(0).transpose();
    const GaussianProcess::Numbers said = process.at(t);
    for (Eigen::Index i = 0; i < 2; ++i) {
      const double scale = process.noise()[i] / noise[i];
      const Eigen::VectorXd told = (covariance + noise[i] * of_noise).inverse() * with;
      CHECK(said.value[i] == Approx(told.dot(known.rows.col(i))).margin(1e-6));
      CHECK(said.variance[i] == Approx(scale * (at.own - with.dot(told))).epsilon(1e-3).margin(1e-5 * scale * at.own));
      CHECK(said.of_noise[i] == Approx(scale * noise[i] * told.dot(of_noise * told)).epsilon(1e-3));
    }
  }
}

TEST_CASE("numbers that bend evenly in other coordinates are told three times better in these") {
  constexpr double bend = 2;
  const auto coordinates = [](const Eigen::VectorXd& t) {
    MaterialPlace place{t, Eigen::MatrixXd::Identity(2, 2)};
    const double share = std::exp(bend * (t[1] - 1));  // most of it near the end
    place.at[1] = 2 * share - 1;
    place.by(1, 1) = 2 * bend * share;
    return place;
  };
  const auto number = [](const MaterialPlace& place) { return std::sin(2 * place.at[1] + place.at[0]); };
  constexpr int count = 16;
  Eigen::MatrixXd points(2, count), rows(3 * count, 1);
  for (int k = 0; k < count; ++k) {
    points.col(k) = low_discrepancy_point(2, k);
    const MaterialPlace place = coordinates(points.col(k));
    const Eigen::Vector2d slope = std::cos(2 * place.at[1] + place.at[0]) * Eigen::Vector2d(1, 2);
    rows.middleRows(3 * k, 3) << number(place), place.by.transpose() * slope;
  }
  const auto error_of = [&](const GaussianProcess& process) {
    double square = 0;
    for (int k = 0; k < 200; ++k) {
      const Eigen::VectorXd t = low_discrepancy_point(2, 1000 + k);
      square += std::pow(process.at(t).value[0] - number(coordinates(t)), 2) / 200;
    }
    return std::sqrt(square);
  };
  const double plain = error_of(process_of(points, rows)), bent = error_of(process_of(points, rows, coordinates));
  CHECK(bent < 0.02);
  CHECK(bent < plain / 3);
}
