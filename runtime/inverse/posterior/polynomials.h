// Products of Legendre polynomials up to a degree in all, and affine coordinates for them to live in.
#pragma once
#include <Eigen/Core>
#include <vector>

namespace itn {

// A box, turned: t = centre + axes w, the box being |w_i| <= 1.
struct Frame {
  Eigen::VectorXd centre;
  Eigen::MatrixXd axes, inverse;

  static Frame whole(Eigen::Index dimensions);
  // Along the principal axes of the points (a column each), as long as they reach times `margin`.
  static Frame around(const Eigen::MatrixXd& points, double margin);

  Eigen::VectorXd of(const Eigen::VectorXd& t) const { return inverse * (t - centre); }
  // The greatest |w_i|.
  double reach(const Eigen::VectorXd& t) const { return of(t).cwiseAbs().maxCoeff(); }
  // True where a rendering at t helps to fit the images in the box.
  bool near(const Eigen::VectorXd& t) const { return reach(t) <= 1.25; }
};

class Polynomials {
 public:
  Polynomials(Frame frame, int degree);
  // As many as fit into `most`, of degree 2 at least.
  static int degree_for(Eigen::Index dimensions, Eigen::Index most);

  Eigen::Index size() const { return static_cast<Eigen::Index>(powers_.size()); }
  const Frame& frame() const { return frame_; }
  const std::vector<std::vector<int>>& powers() const { return powers_; }

  // Their values at t, and, where `by` is given, their derivatives by t: a row a coordinate.
  void evaluate(const Eigen::VectorXd& t, Eigen::VectorXd& values, Eigen::MatrixXd* by = nullptr) const;

 private:
  Frame frame_;
  int degree_;
  std::vector<std::vector<int>> powers_;  // from the constant on, by degree
};

}  // namespace itn
