// Weighted sums of an image's pixels that tell materials apart in one scene, and images of that scene from noise.
#pragma once
#include <Eigen/Core>

#include "runtime/inversion/posterior/exemplar.h"

namespace itn {

class ImageSums {
 public:
  // points: materials, a column each, in the cube [-1, 1]^d. images: of each its image, then the derivatives by the d
  // coordinates, a row each. noise: each pixel's standard deviation. count: so many sums, or as many as materials move.
  ImageSums(const Eigen::MatrixXd& points, const ImageRows& images, const Eigen::VectorXf& noise, Eigen::Index count);

  // Of each row of images.
  Eigen::MatrixXd of(const ImageRows& images) const { return (images * weights_.transpose()).cast<double>(); }

 private:
  ImageRows weights_;  // a row a sum
};

}  // namespace itn
