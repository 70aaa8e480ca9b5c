// The Cramer-Rao bound of cases known by hand, and of least squares in simulated images.
#include "network/evaluation/information.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>

#include "runtime/base/random.h"

using namespace itn;

namespace {

constexpr int spp = 8;

// `groups` renderings, each of half of spp samples, of two pixels with errors that make it 0.5 and 2 with spp samples:
// derivatives (1, 0) and (1, 2) by two parameters, plus noise.
std::vector<Rendering> two_pixels(std::size_t groups, double noise, std::uint64_t seed) {
  std::vector<Rendering> result(groups);
  const float derivative[2][2] = {{1, 1}, {0, 2}};
  for (std::size_t g = 0; g < groups; ++g) {
    result[g].spp = spp / 2;
    for (const float error : {0.5F, 2.0F}) result[g].stderr_.push_back(error * std::sqrt(2.0F));
    for (std::size_t p = 0; p < 2; ++p) {
      Image image;
      for (std::size_t i = 0; i < 2; ++i)
        image.mean.push_back(derivative[p][i] + static_cast<float>(noise * random_normal(seed, p, 2 * g + i)));
      result[g].derivatives.push_back(image);
    }
  }
  return result;
}

FisherInformation information_of(const std::vector<Rendering>& groups) {
  FisherInformation information;
  for (const Rendering& group : groups) information.add(group);
  return information;
}

}  // namespace

TEST_CASE("the information of two pixels, by hand; a pixel without noise is left out") {
  std::vector<Rendering> groups = two_pixels(3, 0, 0);
  const Eigen::MatrixXd information = information_of(groups).of_image(spp);
  // (1, 0) / 0.25 and (1, 2) / 4
  CHECK(information(0, 0) == Approx(4 + 0.25));
  CHECK(information(0, 1) == Approx(0.5));
  CHECK(information(1, 0) == Approx(0.5));
  CHECK(information(1, 1) == Approx(1));
  for (Rendering& group : groups) group.stderr_[0] = 0;
  CHECK(information_of(groups).of_image(spp)(0, 0) == Approx(0.25));
}

TEST_CASE("noise of the derivatives gives the information no bias") {
  constexpr int trials = 4000;
  Eigen::Matrix2d mean = Eigen::Matrix2d::Zero(), square = mean;
  for (int t = 0; t < trials; ++t) {
    const Eigen::Matrix2d one = information_of(two_pixels(4, 1.5, 100U + static_cast<std::uint64_t>(t))).of_image(spp);
    mean += one / trials;
    square += one.cwiseAbs2() / trials;
  }
  const Eigen::Matrix2d exact = information_of(two_pixels(3, 0, 0)).of_image(spp);
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b) {
      const double deviation = std::sqrt((square(a, b) - mean(a, b) * mean(a, b)) / trials);
      CAPTURE(a, b, mean(a, b), exact(a, b), deviation);
      CHECK(std::abs(mean(a, b) - exact(a, b)) < 4 * deviation);
    }
  // With products within groups it would be too large by 1.5^2 / 4 / 0.25 on the diagonal: 14 deviations or more.
  CHECK(square(0, 0) > 0);
}

TEST_CASE("information from two halves of the renderings is that of all of them") {
  const std::vector<Rendering> groups = two_pixels(5, 1.5, 3);
  FisherInformation some = information_of({groups.begin(), groups.begin() + 2});
  some.add(information_of({groups.begin() + 2, groups.end()}));
  CHECK(some.of_image(spp).isApprox(information_of(groups).of_image(spp)));
}

TEST_CASE("bounds agree where no standard deviation differs by a factor of 1.5") {
  const auto bound = [](double a, double b) { return Bound{{}, Eigen::Vector2d(a, b)}; };
  CHECK(agree(bound(1, 1), bound(2.2, 0.5)));
  CHECK_FALSE(agree(bound(1, 1), bound(2.3, 1)));
  CHECK_FALSE(agree(bound(1, 1), bound(1, 0.4)));
}

TEST_CASE("the bound is the inverse information, and with a prior that of their sum") {
  Eigen::Matrix2d information;
  information << 4.25, 0.5, 0.5, 1;
  const Eigen::Vector2d prior(0.1, 3);
  const Bound bound = cramer_rao(information, prior);
  const Eigen::Matrix2d inverse = information.inverse();
  const Eigen::Matrix2d both = (information + Eigen::Matrix2d(prior.cwiseInverse().asDiagonal())).inverse();
  for (int p = 0; p < 2; ++p) {
    CHECK(bound.image[p] == Approx(inverse(p, p)));
    CHECK(bound.with_prior[p] == Approx(both(p, p)));
    CHECK(bound.with_prior[p] < std::min(prior[p], bound.image[p]));
  }
}

TEST_CASE("where the image tells nothing, the bound is the prior, and infinite without it") {
  Eigen::Matrix2d information;
  information << 4, 0, 0, -1;  // noise can make it negative
  const Bound bound = cramer_rao(information, Eigen::Vector2d(1, 9));
  CHECK(std::isinf(bound.image[1]));
  CHECK(bound.with_prior[0] == Approx(0.2));
  CHECK(bound.with_prior[1] == Approx(9));
}

TEST_CASE("least squares in simulated images reach the bound") {
  // Image a x + b x^2 at 50 pixels with noise 0.1: linear in (a, b), so least squares attain it.
  constexpr std::size_t pixels = 50;
  constexpr double noise = 0.1;
  Eigen::MatrixXd design(pixels, 2);
  std::vector<Rendering> groups(3);
  for (auto& group : groups) {
    group.spp = spp;
    group.stderr_.assign(pixels, static_cast<float>(noise));
    group.derivatives.resize(2);
  }
  for (std::size_t i = 0; i < pixels; ++i) {
    const double x = static_cast<double>(i) / pixels;
    design.row(static_cast<Eigen::Index>(i)) << x, x * x;
    for (auto& group : groups) {
      group.derivatives[0].mean.push_back(static_cast<float>(x));
      group.derivatives[1].mean.push_back(static_cast<float>(x * x));
    }
  }
  const Bound bound = cramer_rao(information_of(groups).of_image(spp), Eigen::Vector2d(1e9, 1e9));
  constexpr int trials = 4000;
  Eigen::Vector2d variance = Eigen::Vector2d::Zero();
  const Eigen::Matrix2d normal = design.transpose() * design;
  for (int t = 0; t < trials; ++t) {
    Eigen::VectorXd image(pixels);
    for (std::size_t i = 0; i < pixels; ++i)
      image[static_cast<Eigen::Index>(i)] = noise * random_normal(7, static_cast<std::uint64_t>(t), i);
    variance += (normal.inverse() * (design.transpose() * image)).cwiseAbs2() / trials;
  }
  // The relative standard deviation of a variance of 4000 normal numbers is 0.022.
  CHECK(variance[0] == Approx(bound.image[0]).epsilon(0.09));
  CHECK(variance[1] == Approx(bound.image[1]).epsilon(0.09));
}
