// The kernel of materials, beside dense matrices.
#include "network/prediction/material_kernel.h"

#include <Eigen/LU>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "runtime/inverse/posterior/low_discrepancy.h"

using namespace itn;

namespace {

constexpr Eigen::Index materials = 20, block = 3;

Eigen::MatrixXd points() {
  Eigen::MatrixXd result(block - 1, materials);
  for (int k = 0; k < materials; ++k) result.col(k) = low_discrepancy_point(block - 1, k);
  return result;
}

// Of a bent number.
Eigen::MatrixXd rows() {
  Eigen::MatrixXd result(block * materials, 1);
  for (int k = 0; k < materials; ++k) {
    const Eigen::VectorXd t = low_discrepancy_point(block - 1, k);
    result.middleRows(block * k, block) << std::sin(2 * t[0] + 0.5 * t[1]), 2 * std::cos(2 * t[0] + 0.5 * t[1]),
        0.5 * std::cos(2 * t[0] + 0.5 * t[1]);
  }
  return result;
}

// Coordinates that are not the cube's, with their derivatives.
MaterialPlace bent(const Eigen::VectorXd& t) {
  MaterialPlace place{Eigen::VectorXd(2), Eigen::MatrixXd(2, 2)};
  place.at << t[0] + 0.3 * t[0] * t[1], t[1] + 0.2 * t[1] * t[1] - 0.1 * t[0];
  place.by << 1 + 0.3 * t[1], 0.3 * t[0], -0.1, 1 + 0.4 * t[1];
  return place;
}

// The covariances of rows, and of noise of 1, as a kernel's parts say them.
struct Dense {
  explicit Dense(const MaterialKernel& kernel)
      : basis(kernel.parts(Eigen::MatrixXd::Identity(block * materials, block * materials)).transpose()),
        noise((basis * basis.transpose()).inverse()),
        covariance(basis.rows(), basis.rows()) {
    for (Eigen::Index k = 0; k < materials; ++k)
      covariance.middleRows(block * k, block) = of(kernel, kernel.material(k));
  }
  // Of a value and derivatives at a point with the rows.
  Eigen::MatrixXd of(const MaterialKernel& kernel, const Eigen::VectorXd& point) const {
    return kernel.covariances(point, block).with_parts * basis.inverse();
  }

  Eigen::MatrixXd basis, noise, covariance;
};

}  // namespace

TEST_CASE("a kernel's parts are independent, and of the variances that it says") {
  const MaterialKernel kernel(points(), rows(), GENERATE(plain_place, bent));
  const Dense dense(kernel);
  const Eigen::MatrixXd of_parts = dense.basis.transpose() * dense.covariance * dense.basis;
  CHECK((of_parts - Eigen::MatrixXd(kernel.variances().asDiagonal())).norm() < 1e-6 * of_parts.norm());
  CHECK((dense.covariance - dense.covariance.transpose()).norm() < 1e-6 * dense.covariance.norm());
  for (Eigen::Index k = 0; k < materials; ++k)
    CHECK(dense.covariance(block * k, block * k) == Approx(kernel.covariances(kernel.material(k), 1).own));
}

TEST_CASE("a kernel's derivatives are those of its values") {
  const MaterialKernel kernel(points(), rows(), GENERATE(plain_place, bent));
  constexpr double h = 1e-4;
  for (int k = 0; k < 10; ++k) {
    const Eigen::VectorXd t = low_discrepancy_point(2, 1000 + k);
    const Eigen::MatrixXd said = kernel.covariances(t, block).with_parts;
    for (int i = 0; i < 2; ++i) {
      const Eigen::VectorXd way = h * Eigen::VectorXd::Unit(2, i);
      const Eigen::MatrixXd slope =
          (kernel.covariances(t + way, 1).with_parts - kernel.covariances(t - way, 1).with_parts) / (2 * h);
      CHECK((said.row(1 + i) - slope).norm() < 1e-5 * said.norm());
    }
  }
}

TEST_CASE("what a kernel tells of a material from the others is what they tell without it") {
  const MaterialKernel kernel(points(), rows(), GENERATE(plain_place, bent));
  const Dense dense(kernel);
  const Eigen::MatrixXd given = rows();
  constexpr double noise = 0.03;
  const Eigen::MatrixXd all = dense.covariance + noise * dense.noise;
  for (const Eigen::Index k : {0, 7, 19}) {
    std::vector<Eigen::Index> own, others;
    for (Eigen::Index r = 0; r < block * materials; ++r) (r / block == k ? own : others).push_back(r);
    const Eigen::MatrixXd told = all(own, others) * all(others, others).inverse();
    const Eigen::MatrixXd error = given(own, Eigen::all) - told * given(others, Eigen::all);
    const Eigen::MatrixXd covariance = all(own, own) - told * all(others, own);
    const MaterialKernel::LeftOut said = kernel.left_out(k, noise, kernel.parts(given));
    CHECK(said.errors[0] == Approx(error(0, 0)).margin(1e-6 * given.norm()));
    CHECK(said.variance == Approx(covariance(0, 0)).epsilon(1e-6));
    const double of_noise =
        noise * (dense.noise(own, own) + told * dense.noise(others, others) * told.transpose())(0, 0);
    CHECK(said.of_noise == Approx(of_noise).epsilon(1e-6));
  }
}

TEST_CASE("the likeliest noise of a number is its own") {
  const MaterialKernel kernel(points(), rows(), GENERATE(plain_place, bent));
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const std::array variances{1e-4, 1e-2, 1.0};
  constexpr int numbers = 40;  // of each variance, whose parts are as the kernel says
  Eigen::MatrixXd parts(block * materials, numbers * variances.size());
  for (Eigen::Index j = 0; j < parts.cols(); ++j)
    for (Eigen::Index r = 0; r < parts.rows(); ++r)
      parts(r, j) =
          std::sqrt(kernel.variances()[r] + variances[static_cast<std::size_t>(j / numbers)]) * normal(random);
  const Eigen::ArrayXd said = kernel.likeliest_noises(parts).array().log();
  // Those that are tried are a third apart, and a number's 60 parts tell its variance to some .3, so that the mean of
  // their logarithms is off by some .05.
  for (std::size_t i = 0; i < variances.size(); ++i) {
    const auto some = said.segment(static_cast<Eigen::Index>(i) * numbers, numbers);
    CHECK(std::fabs(some.mean() - std::log(variances[i])) < 0.3);
  }
}
