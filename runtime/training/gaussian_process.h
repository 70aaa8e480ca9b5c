// Several numbers as functions of the material, from their values and derivatives at materials that are known: Gaussian
// processes with one kernel for all (material_kernel.h), each with its own noise.
#pragma once
#include <Eigen/Core>

#include "runtime/training/material_kernel.h"

namespace itn {

class GaussianProcess {
 public:
  // As MaterialKernel's.
  GaussianProcess(const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows,
                  const MaterialCoordinates& coordinates = plain_place);

  struct Prediction {
    Eigen::VectorXd mean, variance;  // of each number; variance: with the noise of a value
  };
  Prediction at(const Eigen::VectorXd& point) const;
  // Errors of the values, each predicted from the other materials, over their standard deviation: a row a material.
  const Eigen::MatrixXd& left_out() const { return left_out_; }

  const MaterialKernel& kernel() const { return kernel_; }

 private:
  MaterialKernel kernel_;
  Eigen::VectorXd noise_, scale_;  // of each number; noise: over scale
  Eigen::MatrixXd weighted_;       // a row as the kernel's parts, a column a number
  Eigen::MatrixXd left_out_;
};

}  // namespace itn
