// Whether a photo is like renderings of a scene, at any material.
//
// Exemplars and their derivatives tell what the scene looks like at other materials: each pixel is a Gaussian process
// of the material (material_kernel.h). What is left of a photo beside the material that fits it best, over the noise,
// is compared with what is left of each exemplar beside what the others tell of it, pixel by pixel and in squares of 3
// x 3 and 7 x 7, where a wrong light, shape, boundary or focus shows far below the noise of a pixel. Less well known
// materials leave more, so the logarithms of what is left are a line of the logarithm of the process's variance; how
// far a photo lies above that line is Student's t.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "runtime/inversion/posterior/exemplar.h"
#include "runtime/training/material_kernel.h"

namespace itn {

class SceneLikeness {
 public:
  // kernel: of any numbers of the exemplars; must outlive this. images: of each exemplar its image, then the
  // derivatives by the d coordinates, a row each. noise: each pixel's standard deviation, in a photo as in an exemplar.
  // width: pixels of a row of the square images.
  SceneLikeness(const MaterialKernel& kernel, const ImageRows& images, const Eigen::VectorXf& noise,
                Eigen::Index width);

  // The largest t of a photo. near: a material to look from for the one that fits it best.
  double doubt(const Eigen::RowVectorXf& photo, const Eigen::VectorXd& near) const;
  // Of photos that are like the scene one in a hundred would exceed it if what is left were normally distributed.
  double limit() const;

 private:
  static constexpr Eigen::Index scales = 3;  // single pixels, and squares of two sizes
  using PerScale = Eigen::Array<double, 1, scales>;

  Eigen::RowVectorXd left_of(const Eigen::RowVectorXd& image, Eigen::VectorXd& at) const;
  PerScale log_sizes(const Eigen::RowVectorXd& left) const;

  const MaterialKernel& kernel_;
  Eigen::Index width_;
  Eigen::RowVectorXd mean_, noise_;
  double emulated_noise_;     // of all pixels, over their scale
  Eigen::MatrixXd weighted_;  // a row as the kernel's parts, a column a pixel, over the noise
  double exemplars_;
  // The line: mean and spread (sum of squares) of the logarithms of the variance, and at each scale height, slope and
  // what the exemplars scatter about it.
  double mean_log_variance_ = 0, spread_ = 0;
  PerScale height_, slope_, deviation_;
};

}  // namespace itn
