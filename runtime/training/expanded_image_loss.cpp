#include "runtime/training/expanded_image_loss.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "runtime/training/object_radiance.h"

namespace itn {
namespace {

// The relative loss's matrix. The estimate is unbiased, so it has small negative eigenvalues along directions that the
// image does not show; as a loss they would drive the network off along these.
Eigen::Matrix3d matrix_of(const ImageCurvature& c, double mean_square) {
  Eigen::Matrix3d matrix;
  matrix << c[0], c[1], c[2],  //
      c[1], c[3], c[4],        //
      c[2], c[4], c[5];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix / mean_square);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0).asDiagonal() * solver.eigenvectors().transpose();
}

class ExpandedLoss : public ImageLoss {
 public:
  ExpandedLoss(const DatasetImages& training, const DatasetImages& validation)
      : training_(examples_of(training, least_mean_square(training))),
        validation_(examples_of(validation, least_mean_square(training))) {}

  Result evaluate(std::span<const std::size_t> examples, std::span<const double> parameters, std::uint64_t) override {
    return evaluate(training_, examples, parameters);
  }
  double validate(std::span<const std::size_t> examples, std::span<const double> parameters) override {
    return evaluate(validation_, examples, parameters).loss;
  }

 private:
  struct Example {
    Eigen::Matrix3d curvature;
    Eigen::Vector3d truth;  // log sigma_t, albedo, g
  };

  static std::vector<Example> examples_of(const DatasetImages& images, double least_square) {
    std::vector<Example> examples;
    for (std::size_t i = 0; i < images.images.size(); ++i) {
      const Manifest::Image& image = images.images[i];
      const double mean_square = std::max(object_radiance(images, i).mean_square, least_square);
      examples.push_back(
          {matrix_of(images.curvature[i], mean_square), {std::log(image.sigma_t), image.albedo, image.g}});
    }
    return examples;
  }

  static Result evaluate(const std::vector<Example>& of, std::span<const std::size_t> examples,
                         std::span<const double> parameters) {
    Result result;
    const double share = 1 / static_cast<double>(examples.size());
    for (std::size_t i = 0; i < examples.size(); ++i) {
      const Example& example = of[examples[i] % of.size()];  // mirror images have the loss of what they mirror
      const double sigma_t = parameters[3 * i];
      const Eigen::Vector3d error =
          Eigen::Vector3d(std::log(sigma_t), parameters[3 * i + 1], parameters[3 * i + 2]) - example.truth;
      const Eigen::Vector3d slope = example.curvature * error;
      result.loss += share * error.dot(slope);
      result.gradient.push_back(2 * share * slope[0] / sigma_t);
      result.gradient.push_back(2 * share * slope[1]);
      result.gradient.push_back(2 * share * slope[2]);
    }
    return result;
  }

  std::vector<Example> training_, validation_;
};

}  // namespace

std::unique_ptr<ImageLoss> make_expanded_image_loss(const DatasetImages& training, const DatasetImages& validation) {
  return std::make_unique<ExpandedLoss>(training, validation);
}

}  // namespace itn
