// A scene whose pixels are formulas of the material: which photos are like it.
#include "network/prediction/scene_likeness.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <optional>
#include <random>

#include "runtime/inverse/posterior/low_discrepancy.h"

using namespace itn;

namespace {

constexpr Eigen::Index side = 16;
constexpr float noise = 0.05F;

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
  Scene() {
    constexpr int exemplars = 24;
    for (int k = 0; k < exemplars; ++k) show(low_discrepancy_point(2, k));
    learn();
  }

  void show(const Eigen::VectorXd& at) {
    constexpr double h = 1e-2;
    const Eigen::Index count = points_.cols(), first = 3 * count;
    points_.conservativeResize(2, count + 1);
    points_.col(count) = at;
    seen_.images.conservativeResize(first + 3, side * side);
    seen_.halves.conservativeResize(first + 3, side * side);
    seen_.errors.conservativeResize(count + 1, side * side);
    seen_.images.row(first) = noisy(picture(at), noise);
    for (int i = 0; i < 2; ++i) {
      const Eigen::VectorXd way = h * Eigen::VectorXd::Unit(2, i);
      const Eigen::RowVectorXd slope = (picture(at + way) - picture(at - way)).cast<double>() / (2 * h);
      seen_.images.row(first + 1 + i) = noisy(slope.cast<float>(), noise);
    }
    for (Eigen::Index r = 0; r < 3; ++r)
      seen_.halves.row(first + r) = noisy(Eigen::RowVectorXf::Zero(side * side), noise);
    seen_.errors.row(count).setConstant(noise);
  }

  void learn() {
    // A sum of pixels chooses the lengths.
    Eigen::VectorXd rows = seen_.images.leftCols(40).rowwise().sum().cast<double>();
    double mean = 0, square = 0;
    for (Eigen::Index k = 0; k < rows.size(); k += 3) mean += 3 * rows[k] / static_cast<double>(rows.size());
    for (Eigen::Index k = 0; k < rows.size(); k += 3) rows[k] -= mean;
    for (Eigen::Index k = 0; k < rows.size(); k += 3)
      square += 3 * rows[k] * rows[k] / static_cast<double>(rows.size());
    likeness_.emplace(std::make_shared<const MaterialKernel>(points_, rows / std::sqrt(square)), seen_, side);
  }

  Eigen::RowVectorXf noisy(Eigen::RowVectorXf image, float deviation) {
    for (float& value : image) value += deviation * normal_(random_);
    return image;
  }
  // Share of 40 photos of materials anywhere that are doubted. deviation: of their noise, which they tell.
  template <class Spoil>
  double doubted(const Spoil& spoil, float deviation = noise) {
    int count = 0;
    for (int k = 0; k < 40; ++k)
      count +=
          doubt(noisy(spoil(picture(low_discrepancy_point(2, 500 + k))), deviation), deviation) > SceneLikeness::limit;
    return count / 40.0;
  }
  double doubt(const Eigen::RowVectorXf& photo, float deviation = noise) const {
    return likeness_->doubt(photo, Eigen::RowVectorXf::Constant(side * side, deviation), Eigen::VectorXd::Zero(2));
  }
  const SceneLikeness& likeness() const { return *likeness_; }

 private:
  std::mt19937_64 random_{5};
  std::normal_distribution<float> normal_;
  SeenExemplars seen_;
  Eigen::MatrixXd points_;
  std::optional<SceneLikeness> likeness_;
};

Eigen::RowVectorXf as_it_is(Eigen::RowVectorXf image) { return image; }

// On an eighth of the picture, so many times the noise of a pixel.
Eigen::RowVectorXf with_shadow(Eigen::RowVectorXf image, float depth) {
  for (Eigen::Index y = 5; y < 11; ++y) image.segment(side * y + 5, 6).array() -= depth * noise;
  return image;
}

}  // namespace

TEST_CASE("photos of a scene are seldom doubted, spoilt ones mostly") {
  Scene scene;
  CHECK(scene.doubted(as_it_is) <= 0.05);
  const auto is_found = [&](const auto& spoil) { CHECK(scene.doubted(spoil) >= 0.9); };
  is_found([&](const Eigen::RowVectorXf& image) { return scene.noisy(image, noise); });
  is_found([](const Eigen::RowVectorXf& image) { return Eigen::RowVectorXf(1.1F * image); });
  is_found([](const Eigen::RowVectorXf& image) { return Eigen::RowVectorXf(image.reverse()); });
  is_found([](const Eigen::RowVectorXf& image) { return with_shadow(image, 2); });
}

TEST_CASE("photos that are noisier than the exemplars, or less, are doubted as seldom if they say so") {
  Scene scene;
  for (const float deviation : {3 * noise, noise / 3}) {
    CHECK(scene.doubted(as_it_is, deviation) <= 0.05);
    CHECK(scene.doubted([](const Eigen::RowVectorXf& image) { return Eigen::RowVectorXf(1.4F * image); }, deviation) >=
          0.9);
  }
}

TEST_CASE("the best fit is near the material of a photo") {
  Scene scene;
  for (int k = 0; k < 10; ++k) {
    const Eigen::VectorXd at = low_discrepancy_point(2, 500 + k);
    const Eigen::VectorXd found = scene.likeness().best_fit(scene.noisy(picture(at), noise), Eigen::VectorXd::Zero(2));
    CHECK((found - at).norm() < 0.1);
  }
}

TEST_CASE("a rendering of the photo's own material makes no photo of the scene doubted, and hides no shadow") {
  Scene scene;
  int right = 0, found = 0;
  for (int k = 0; k < 20; ++k) {
    const Eigen::VectorXd at = low_discrepancy_point(2, 500 + k);
    Scene again = scene;
    again.show(at);
    again.learn();
    right += again.doubt(scene.noisy(picture(at), noise)) > SceneLikeness::limit;
    found += again.doubt(scene.noisy(with_shadow(picture(at), 2), noise)) > SceneLikeness::limit;
  }
  CHECK(right <= 2);
  CHECK(found >= 18);
}
