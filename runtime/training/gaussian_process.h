// Several numbers as functions of the material, from their values and derivatives at materials that are known: Gaussian
// processes with one kernel for all (Rasmussen and Williams 2006, chapter 2 and section 9.4), a linear function and a
// squared exponential with a length for each coordinate. Lengths and noise are those of the largest evidence.
#pragma once
#include <Eigen/Core>

namespace itn {

class GaussianProcess {
 public:
  // points: the materials, a column each, in the cube [-1, 1]^d. rows: of each material the values, then the
  // derivatives by the d coordinates; a column a number, whose values have the mean 0 and the variance 1 or are all 0.
  GaussianProcess(const Eigen::MatrixXd& points, const Eigen::MatrixXd& rows);

  struct Prediction {
    Eigen::VectorXd mean;
    double variance = 0;  // with the noise of a value; times scale() it is each number's
  };
  Prediction at(const Eigen::VectorXd& point) const;

  // For other numbers at the same materials, `rows` of them as of the constructor (values with a mean of 0):
  // covariances(point) * weigh(rows) are their values, then their derivatives by the coordinates, at a material.
  Eigen::MatrixXd covariances(const Eigen::VectorXd& point) const;
  Eigen::MatrixXd weigh(const Eigen::MatrixXd& rows) const { return precision_ * rows; }

  Eigen::Index dimensions() const { return points_.rows(); }
  Eigen::VectorXd point(Eigen::Index material) const { return points_.col(material); }

  const Eigen::VectorXd& scale() const { return scale_; }
  // Errors of the values, each predicted from the other materials, over the square root of the variance: a row a
  // material.
  const Eigen::MatrixXd& left_out() const { return left_out_; }
  // Of a material's own rows where the others tell them, over scale(). Times its rows of weigh() it is by how much
  // these are not what the others tell.
  Eigen::MatrixXd left_out_covariance(Eigen::Index material) const;

  struct Scales {
    Eigen::VectorXd length;
    double linear = 1;                             // variance of the linear function
    double value_noise = 0, derivative_noise = 0;  // variances
  };

 private:
  Eigen::MatrixXd points_;
  Scales scales_;
  Eigen::MatrixXd precision_, weighted_;  // inverse of the rows' covariance, and that times the rows
  Eigen::VectorXd scale_;
  Eigen::MatrixXd left_out_;
};

}  // namespace itn
