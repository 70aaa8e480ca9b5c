// A scene whose pixels are formulas of the material: which photos are like it.
#include "runtime/training/scene_likeness.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "runtime/inversion/posterior/low_discrepancy.h"

using namespace itn;

namespace {

constexpr Eigen::Index side = 16;
constexpr float noise = 0.05F;
constexpr int exemplars = 24;

// Of a material in the cube [-1, 1]^2.
Eigen::RowVectorXf picture(const Eigen::VectorXd& at) {
  Eigen::RowVectorXf result(side * side);
  for (Eigen::Index i = 0; i < result.size(); ++i) {
    const double x = static_cast<double>(i % side) / side, y = static_cast<double>(i / side) / side;
    result[i] = static_cast<float>(std::sin(2 * x + at[0]) + std::exp(0.5 * at[1] * y) + 0.2 * at[0] * at[1] * x * y);
  }
  return result;
}

class Scene {
 public:
  Scene() : images_(3 * exemplars, side * side), points_(2, exemplars), rows_(3 * exemplars, 1) {
    constexpr double h = 1e-2;
    for (int k = 0; k < exemplars; ++k) {
      points_.col(k) = low_discrepancy_point(2, k);
      images_.row(3 * k) = noisy(picture(points_.col(k)), noise);
      for (int i = 0; i < 2; ++i) {
        const Eigen::VectorXd way = h * Eigen::VectorXd::Unit(2, i);
        const Eigen::RowVectorXf slope =
            (picture(points_.col(k) + way) - picture(points_.col(k) - way)) / static_cast<float>(2 * h);
        images_.row(3 * k + 1 + i) = noisy(slope, noise);
      }
    }
    // A sum of pixels chooses the lengths.
    for (Eigen::Index r = 0; r < rows_.rows(); ++r) rows_(r, 0) = static_cast<double>(images_.row(r).head(40).sum());
    double mean = 0, square = 0;
    for (int k = 0; k < exemplars; ++k) mean += rows_(3 * k, 0) / exemplars;
    for (int k = 0; k < exemplars; ++k) rows_(3 * k, 0) -= mean;
    for (int k = 0; k < exemplars; ++k) square += rows_(3 * k, 0) * rows_(3 * k, 0) / exemplars;
    rows_ /= std::sqrt(square);
    kernel_.emplace(points_, rows_);
    likeness_.emplace(*kernel_, images_, Eigen::VectorXf::Constant(side * side, noise), side);
  }

  Eigen::RowVectorXf noisy(Eigen::RowVectorXf image, float deviation) {
    for (float& value : image) value += deviation * normal_(random_);
    return image;
  }
  // Share of 40 photos of materials anywhere that are doubted.
  template <class Spoil>
  double doubted(const Spoil& spoil) {
    int count = 0;
    for (int k = 0; k < 40; ++k) {
      const Eigen::RowVectorXf photo = noisy(spoil(picture(low_discrepancy_point(2, 500 + k))), noise);
      count += likeness_->doubt(photo, Eigen::VectorXd::Zero(2)) > likeness_->limit();
    }
    return count / 40.0;
  }
  const SceneLikeness& likeness() const { return *likeness_; }

 private:
  std::mt19937_64 random_{5};
  std::normal_distribution<float> normal_;
  ImageRows images_;
  Eigen::MatrixXd points_, rows_;
  std::optional<MaterialKernel> kernel_;
  std::optional<SceneLikeness> likeness_;
};

}  // namespace

TEST_CASE("photos of a scene are seldom doubted, spoilt ones mostly") {
  Scene scene;
  CHECK(scene.doubted([](Eigen::RowVectorXf image) { return image; }) <= 0.05);
  const auto is_found = [&](const auto& spoil) { CHECK(scene.doubted(spoil) >= 0.9); };
  is_found([&](const Eigen::RowVectorXf& image) { return scene.noisy(image, noise); });
  is_found([](const Eigen::RowVectorXf& image) { return Eigen::RowVectorXf(1.1F * image); });
  is_found([](const Eigen::RowVectorXf& image) { return Eigen::RowVectorXf(image.reverse()); });
  is_found([](Eigen::RowVectorXf image) {  // a shadow on an eighth of the picture, twice the noise of a pixel
    for (Eigen::Index y = 5; y < 11; ++y) image.segment(side * y + 5, 6).array() -= 2 * noise;
    return image;
  });
}

TEST_CASE("what one in three hundred of Student's t exceed is the limit of a doubt at each of three scales") {
  // Of 24 exemplars: 22 degrees of freedom.
  constexpr double freedom = exemplars - 2;
  const double unit =
      std::tgamma((freedom + 1) / 2) / (std::sqrt(freedom * std::acos(-1.0)) * std::tgamma(freedom / 2));
  const double limit = Scene().likeness().limit();
  constexpr double step = 1e-3;
  double above = 0;
  for (int k = 0; k < 100'000; ++k)
    above += step * unit * std::pow(1 + std::pow(limit + (k + 0.5) * step, 2) / freedom, -(freedom + 1) / 2);
  CHECK(above == Approx(0.01 / 3).epsilon(0.01));
}
