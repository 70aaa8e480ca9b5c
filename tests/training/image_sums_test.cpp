// Sums of pixels that tell materials apart, of images that are formulas.
#include "network/prediction/image_sums.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "runtime/inverse/posterior/low_discrepancy.h"

using namespace itn;

namespace {

constexpr Eigen::Index pixels = 400;

// What a material adds to an image: the first number a slope from left to right, the second a ring.
Eigen::RowVectorXf pattern(int number) {
  Eigen::RowVectorXf result(pixels);
  for (Eigen::Index i = 0; i < pixels; ++i) {
    const double x = static_cast<double>(i % 20) / 20 - 0.5, y = static_cast<double>(i / 20) / 20 - 0.5;
    result[i] = static_cast<float>(number == 0 ? x : std::exp(-20 * (x * x + y * y)));
  }
  return result;
}

}  // namespace

TEST_CASE("image sums are along what materials change, over the noise, and not along the noise") {
  constexpr int count = 16;
  std::mt19937_64 random(2);
  std::normal_distribution<float> normal;
  Eigen::VectorXf noise = Eigen::VectorXf::Constant(pixels, 0.05F);
  noise.head(40).setConstant(5);  // two rows of which nothing is to be learnt
  Eigen::MatrixXd points(2, count);
  ImageRows images(3 * count, pixels);
  for (int k = 0; k < count; ++k) {
    points.col(k) = low_discrepancy_point(2, k);
    images.row(3 * k) = Eigen::RowVectorXf::Ones(pixels) + static_cast<float>(points(0, k)) * pattern(0) +
                        static_cast<float>(points(1, k)) * pattern(1);
    images.row(3 * k + 1) = pattern(0);
    images.row(3 * k + 2) = pattern(1);
    for (Eigen::Index r = 3 * k; r < 3 * k + 3; ++r)
      images.row(r) += noise.transpose().unaryExpr([&](float e) { return e * normal(random); });
  }
  const ImageSums sums(points, images, ImageRows::Zero(images.rows(), pixels), noise, 2);
  ImageRows ways(3, pixels);
  ways << pattern(0), pattern(1), Eigen::RowVectorXf::Unit(pixels, 7);
  const Eigen::MatrixXd moved = sums.of(ways);
  REQUIRE(moved.cols() == 2);
  // Both patterns move the sums, each another way, as much as they could: over the noise their length is the pattern's.
  const Eigen::MatrixXd both = moved.topRows(2) * moved.topRows(2).transpose();
  ImageRows white = ways.topRows(2) * noise.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd most = (white * white.transpose()).cast<double>();
  CHECK((both - most).norm() < 0.05 * most.norm());
  // A pixel of great noise hardly does.
  CHECK(moved.row(2).norm() < 0.05);
}

TEST_CASE("the noise that image sums are made from does not move the sums of the images that it comes from", "[stat]") {
  constexpr int count = 16;
  constexpr float noise = 1;  // of an image, so that all patterns together are as strong as it is in a pixel or two
  std::mt19937_64 random(5);
  std::normal_distribution<float> normal;
  const auto noisy = [&](const Eigen::RowVectorXf& image) -> Eigen::RowVectorXf {
    return image + Eigen::RowVectorXf::NullaryExpr(pixels, [&] { return std::sqrt(2.0F) * noise * normal(random); });
  };
  Eigen::MatrixXd points(2, count);
  ImageRows clean(3 * count, pixels), images(3 * count, pixels), halves(3 * count, pixels);
  for (int k = 0; k < count; ++k) {
    points.col(k) = low_discrepancy_point(2, k);
    clean.row(3 * k) = static_cast<float>(points(0, k)) * pattern(0) + static_cast<float>(points(1, k)) * pattern(1);
    clean.row(3 * k + 1) = pattern(0);
    clean.row(3 * k + 2) = pattern(1);
  }
  for (Eigen::Index r = 0; r < clean.rows(); ++r) {
    const Eigen::RowVectorXf a = noisy(clean.row(r)), b = noisy(clean.row(r));
    images.row(r) = (a + b) / 2;
    halves.row(r) = (a - b) / 2;
  }
  const ImageSums sums(points, images, halves, Eigen::VectorXf::Constant(pixels, noise), 2);
  // Were noise to move the sums as materials do, errors would be along what is expected.
  const auto along = [&](const Eigen::MatrixXd& found) {
    const Eigen::MatrixXd expected = sums.of(clean);
    return (found - expected).cwiseProduct(expected).sum() / expected.norm();
  };
  CHECK(std::fabs(along(sums.of_own())) < 3.3);
  CHECK(along(sums.of(images)) > 10);
}
