// Weighted sums of an image's pixels that tell materials apart in one scene, and images of that scene from noise.
#pragma once
#include <Eigen/Core>

#include "runtime/inverse/posterior/exemplar.h"

namespace itn {

class ImageSums {
 public:
  // points: materials, a column each, in the cube [-1, 1]^d. images: of each its image, then the derivatives by the d
  // coordinates, a row each, from two halves of its samples that know nothing of each other; halves: half of the first
  // half's less half of the second's. noise: each pixel's standard deviation. count: so many sums, or as many as
  // materials move.
  ImageSums(const Eigen::MatrixXd& points, const ImageRows& images, const ImageRows& halves,
            const Eigen::VectorXf& noise, Eigen::Index count);

  // Of each row of other images than these.
  Eigen::MatrixXd of(const ImageRows& images) const { return (images * weights_.transpose()).cast<double>(); }
  // Of these. The sums are made from these images, so that each image's noise has a part in them, whose square it does
  // not share with other images: only products of different halves count.
  const Eigen::MatrixXd& of_own() const { return of_own_; }

 private:
  ImageRows weights_;  // a row a sum
  Eigen::MatrixXd of_own_;
};

}  // namespace itn
