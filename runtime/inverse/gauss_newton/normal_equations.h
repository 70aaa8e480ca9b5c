// Least-squares equations of several renderings, pooled: each is linear about the unknowns that it was made with, and
// together they have the noise of all their samples.
#pragma once
#include <string>
#include <vector>

#include "runtime/inverse/gauss_newton/least_squares.h"
#include "runtime/inverse/prior.h"

namespace itn {

class NormalEquations {
 public:
  explicit NormalEquations(std::size_t unknowns = 0);

  // x: the unknowns of these equations. All that are pooled have the same references.
  void add(const LeastSquares& equations, const std::vector<double>& x);
  bool empty() const { return count_ == 0; }
  double count() const { return count_; }

  struct Solution {
    Eigen::VectorXd x;
    Eigen::MatrixXd covariance;    // of x: the targets' noise, the rendering's, and what the prior leaves open
    double monte_carlo_share = 0;  // of the rendering in it, mean over the unknowns
    // The pixels' information is less than three standard errors of its own along some direction. There only the prior
    // moves x, and gives the covariance; without any the information is taken to be those three, so x does not move
    // far.
    bool hidden = false;
    bool determined = true;  // each direction by the pixels or by the prior
    Eigen::MatrixXd information;
    // Root mean square over the unknowns of the distance from `from`, in standard errors.
    double distance(const std::vector<double>& from) const;
  };
  // from: the unknowns that it starts at. prior: of the first of them; it counts beside pixels whose noise is what the
  // residuals say it is, so that with it x is the mean of the posterior, as far as all are normal. Throws ResultError:
  // an unknown on which no pixel depends (names: of the unknowns).
  Solution solve(const std::vector<double>& from, const std::vector<std::string>& names, const Prior& prior = {}) const;

  // Everything as plain numbers, to store.
  std::vector<double> numbers() const;
  // Are so many numbers those of equations for so many unknowns, or none?
  static bool fits(std::size_t unknowns, std::size_t numbers) {
    return numbers == 0 || numbers == 2 + unknowns + (4 + unknowns) * unknowns * unknowns;
  }
  static NormalEquations from_numbers(std::size_t unknowns, const std::vector<double>& numbers);

 private:
  double count_ = 0, residuals_ = 0;
  Eigen::VectorXd right_;  // sum of information x - gradient
  Eigen::MatrixXd information_, scale_, spread_, monte_carlo_;
  std::vector<Eigen::MatrixXd> information_noise_;
};

}  // namespace itn
