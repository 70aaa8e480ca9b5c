#include "network/prediction/image_sums.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "runtime/inverse/posterior/polynomial_fit.h"

namespace itn {

// A polynomial of the material is fitted to each pixel, over its noise. Its polynomials are orthonormal over the cube,
// so that the products of their coefficients, but for the constant's, are the image's covariance over all materials,
// whose greatest directions are the sums.
ImageSums::ImageSums(const Eigen::MatrixXd& points, const ImageRows& images, const ImageRows& halves,
                     const Eigen::VectorXf& noise, Eigen::Index count) {
  constexpr int degree = 2;
  constexpr double of_derivative = 0.3;  // the weight of a derivative beside that of a value
  constexpr double ridge = 1e-3;         // times 10 to the power of the degree: few images tell little of the highest
  const Polynomials polynomials(Frame::whole(points.rows()), degree);
  std::vector<Eigen::VectorXd> at;
  for (Eigen::Index k = 0; k < points.cols(); ++k) at.emplace_back(points.col(k));
  const DesignRows design(polynomials, at);
  Eigen::VectorXd weight = Eigen::VectorXd::Constant(design.rows.rows(), of_derivative * of_derivative);
  for (Eigen::Index r = 0; r < weight.size(); r += design.block) weight[r] = 1;
  const Eigen::MatrixXd weighted = design.rows.transpose() * weight.asDiagonal();
  Eigen::MatrixXd normal = weighted * design.rows;
  for (Eigen::Index k = 0; k < normal.rows(); ++k) {
    const std::vector<int>& powers = polynomials.powers()[static_cast<std::size_t>(k)];
    normal(k, k) += ridge * std::pow(10, std::accumulate(powers.begin(), powers.end(), 0));
  }
  const Eigen::MatrixXd fit = Eigen::LLT<Eigen::MatrixXd>(normal).solve(weighted);
  const ImageRows moving = fit.bottomRows(fit.rows() - 1).cast<float>() * images * noise.cwiseInverse().asDiagonal();

  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen((moving * moving.transpose()).cast<double>());
  count = std::min(count, moving.rows());
  const Eigen::VectorXd size = eigen.eigenvalues().tail(count).cwiseMax(1e-12).cwiseSqrt();
  const Eigen::MatrixXd turned = size.cwiseInverse().asDiagonal() * eigen.eigenvectors().rightCols(count).transpose();
  weights_ = turned.cast<float>() * moving * noise.cwiseInverse().asDiagonal();

  const Eigen::MatrixXd from = turned * fit.bottomRows(fit.rows() - 1);  // of the images, over the noise
  of_own_ = of(images);
  for (Eigen::Index r = 0; r < images.rows(); r += design.block) {
    const ImageRows own = halves.middleRows(r, design.block) * noise.cwiseInverse().asDiagonal();
    of_own_.middleRows(r, design.block) -=
        (own * own.transpose()).cast<double>() * from.middleCols(r, design.block).transpose();
  }
}

}  // namespace itn
