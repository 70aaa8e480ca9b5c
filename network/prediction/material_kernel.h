// How much a number at one material tells of it at another, where the number is a smooth function of the material: a
// linear function and a squared exponential with a length for each coordinate (material_coordinates.h), of values and
// derivatives (Rasmussen and Williams 2006, chapter 2 and section 9.4). The covariance of all rows at the materials
// that are known is taken apart into independent parts once, so that noise, whatever its variance, is only added to the
// variance of each.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "network/prediction/material_coordinates.h"

namespace itn {

class MaterialKernel {
 public:
  // points: the materials, a column each, in the cube [-1, 1]^d. rows: of each material the values, then the
  // derivatives by the d coordinates; a column a number, whose values have the mean 0 and the variance 1 or are all 0.
  // Lengths are those of the largest evidence, where each number has a noise of its own.
  MaterialKernel(const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows,
                 const MaterialCoordinates& coordinates = plain_place);

  Eigen::Index dimensions() const { return points_.rows(); }
  Eigen::VectorXd material(Eigen::Index k) const { return points_.col(k); }

  // Of any numbers' rows, a column each.
  Eigen::MatrixXd parts(const Eigen::MatrixXd& rows) const;
  // Of each part, without noise, for a number of unit variance.
  const Eigen::VectorXd& variances() const { return variances_; }
  // At a point. with_parts: of a number's value there, then of its derivatives by the coordinates, a row each.
  struct Covariances {
    Eigen::MatrixXd with_parts;
    double own = 0;  // of the value with itself
  };
  // count: so many rows.
  Covariances covariances(const Eigen::VectorXd& point, Eigen::Index count) const;

  // Of each column of parts the variance of a value's noise, over the number's own, that is likeliest of a few dozen.
  Eigen::VectorXd likeliest_noises(const Eigen::MatrixXd& parts) const;
  struct LeftOut {
    Eigen::RowVectorXd errors;  // of a material's values over what the other materials tell of them
    double variance = 0;        // of these, with the value's own noise, for a number of unit variance
    double of_noise = 0;        // the part of the variance that is noise
  };
  // parts: a column a number, all with such noise.
  LeftOut left_out(Eigen::Index material, double noise, const Eigen::MatrixXd& parts) const;

  struct Scales {
    Eigen::VectorXd length;
    double linear = 1;            // variance of the linear function
    double derivative_noise = 1;  // variance over that of a value
  };

 private:
  MaterialCoordinates coordinates_;
  Eigen::MatrixXd points_;
  std::vector<MaterialPlace> places_;  // of these
  Scales scales_;
  Eigen::MatrixXd basis_;  // rows, with the derivatives by the coordinates, to parts
  Eigen::VectorXd variances_;
};

}  // namespace itn
