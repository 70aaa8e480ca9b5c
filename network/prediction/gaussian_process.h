// Several numbers as functions of the material, from their values and derivatives at materials that are known: Gaussian
// processes with one kernel for all (material_kernel.h), each with its own noise.
#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "network/prediction/material_kernel.h"

namespace itn {

class GaussianProcess {
 public:
  // rows: as the kernel's, of any numbers.
  GaussianProcess(std::shared_ptr<const MaterialKernel> kernel, const Eigen::MatrixXd& rows);

  // Of each number.
  struct Numbers {
    Eigen::VectorXd value, variance;
    Eigen::VectorXd of_noise;  // the part of the variance that the noise of what is known has
  };
  // What is told of the values at a point, without a noise of their own.
  Numbers at(const Eigen::VectorXd& point) const;
  // The values at a point, then their derivatives by the coordinates of the cube, a row each.
  Eigen::MatrixXd with_derivatives(const Eigen::VectorXd& point) const;
  // Errors of a material's values, each predicted from the other materials; variance: with their own noise.
  Numbers left_out(Eigen::Index material) const;
  // Variance of a value's own noise.
  const Eigen::VectorXd& noise() const { return noise_; }

  const std::shared_ptr<const MaterialKernel>& kernel() const { return kernel_; }

 private:
  // Numbers whose noise, over their scale, is the same.
  struct Alike {
    double noise = 0;
    std::vector<Eigen::Index> which;
    Eigen::MatrixXd parts;
  };
  // Of these, for numbers of unit variance.
  void set_variances(Numbers& numbers, const Alike& alike, double variance, double of_noise) const;

  std::shared_ptr<const MaterialKernel> kernel_;
  std::vector<Alike> alike_;
  // A row for each of these, of the squares of a value's covariances with the parts: what the parts tell of its
  // variance, and what their noise adds.
  Eigen::MatrixXd told_, of_noise_;
  Eigen::VectorXd noise_, scale_;  // of each number
  Eigen::MatrixXd weighted_;       // a row as the kernel's parts, a column a number
};

}  // namespace itn
