// How much a number at one material tells of it at another, where the number is a smooth function of the material: a
// linear function and a squared exponential with a length for each coordinate, of values and derivatives (Rasmussen and
// Williams 2006, chapter 2 and section 9.4). The covariance of all rows at the materials that are known is taken apart
// into independent parts once, so that noise, whatever its variance, is only added to the variance of each.
#pragma once
#include <Eigen/Core>

namespace itn {

class MaterialKernel {
 public:
  // points: the materials, a column each, in the cube [-1, 1]^d. rows: of each material the values, then the
  // derivatives by the d coordinates; a column a number, whose values have the mean 0 and the variance 1 or are all 0.
  // Lengths are those of the largest evidence, where each number has a noise of its own.
  MaterialKernel(const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows);

  Eigen::Index dimensions() const { return points_.rows(); }
  Eigen::Index materials() const { return points_.cols(); }
  Eigen::VectorXd material(Eigen::Index k) const { return points_.col(k); }

  // Of any numbers' rows, a column each.
  Eigen::MatrixXd parts(const Eigen::MatrixXd& rows) const { return basis_.transpose() * rows; }
  // Of each part, without noise, for a number of unit variance.
  const Eigen::VectorXd& variances() const { return variances_; }
  // With the parts, of a number's value at a point, then of its derivatives by the coordinates: so many rows of that.
  Eigen::MatrixXd covariances(const Eigen::VectorXd& point, Eigen::Index count) const;
  double variance(const Eigen::VectorXd& point) const;  // of the value

  // The variance of a value's noise, over the number's own, that is likeliest after the parts of some numbers.
  double likeliest_noise(const Eigen::MatrixXd& parts) const;
  // Of a material's own rows, where the others tell them, and numbers have such noise.
  Eigen::MatrixXd left_out_covariance(Eigen::Index material, double noise) const;
  // By how much these are not what the others tell, a column a number.
  Eigen::MatrixXd left_out(Eigen::Index material, double noise, const Eigen::MatrixXd& parts) const;

  struct Scales {
    Eigen::VectorXd length;
    double linear = 1;            // variance of the linear function
    double derivative_noise = 1;  // variance over that of a value
  };

 private:
  Eigen::MatrixXd points_;
  Scales scales_;
  Eigen::MatrixXd basis_;  // rows to parts
  Eigen::VectorXd variances_;
};

}  // namespace itn
