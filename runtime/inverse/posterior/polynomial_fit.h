// A number as a polynomial of the material, from values and derivatives that are noisy: linear regression with a normal
// prior of the coefficients, variance s^2 * product of r_i^(2 power_i), which falls by degree as it does for analytic
// functions; s, the r_i and what the polynomial cannot follow come from the largest evidence.
#pragma once
#include <Eigen/Core>

#include "runtime/inverse/posterior/polynomials.h"

namespace itn {

// Rows: of each rendering its value, then its derivatives by the coordinates.
struct DesignRows {
  DesignRows(const Polynomials& polynomials, const std::vector<Eigen::VectorXd>& points);

  Eigen::Index block = 1;  // rows a rendering
  Eigen::MatrixXd rows;    // a column a polynomial
  Eigen::VectorXd rest;    // mean square of the polynomials of highest degree: how what lacks grows
};

// The same at a point.
struct DesignPoint {
  DesignPoint(const Polynomials& polynomials, const Eigen::VectorXd& t);
  Eigen::VectorXd values;
  double rest = 0;
};

class PolynomialFit {
 public:
  struct Scales {
    double size = 1;        // s
    Eigen::VectorXd decay;  // r_i
    double lacking = 0;     // standard deviation of what the polynomial cannot follow
  };

  // noise: variances, one a row.
  PolynomialFit(const Polynomials& polynomials, const DesignRows& design, const Eigen::VectorXd& values,
                const Eigen::VectorXd& noise);

  double mean(const DesignPoint& at) const { return coefficients_.dot(at.values); }
  const Eigen::VectorXd& coefficients() const { return coefficients_; }
  // Variance of the mean's error: from the noise of the values and derivatives, the prior, and what the polynomial
  // cannot follow.
  double variance(const DesignPoint& at) const;

  const Scales& scales() const { return scales_; }
  // Errors of the values over their standard deviations, one for each rendering, predicted from the others.
  const Eigen::VectorXd& left_out() const { return left_out_; }
  // Mean square of these.
  double leave_one_out() const { return leave_one_out_; }

 private:
  Scales scales_;
  Eigen::VectorXd coefficients_, left_out_;
  Eigen::MatrixXd root_;  // variance: the square of root_ * values
  double leave_one_out_ = 1, inflation_ = 1;
};

}  // namespace itn
