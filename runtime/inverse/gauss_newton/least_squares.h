// Rendered images against targets as a weighted least-squares problem, which Gauss-Newton solves and which tells the
// parameters' uncertainty.
//
// Unknowns x: the coordinates of the parameters, then, where the exposures are unknown, log s of every target (the
// model of a target is s T), then, where the white balance is unknown, log b of red and of blue, which all targets
// share (the model is s b T, green's b is 1). r = s T - I is linear in a rendering's samples, and so is J = d r / d x.
// Multiplied with numbers that know nothing of these samples, their means have no bias at any number of samples: the
// equations are
//
//   sum of w Z r = 0,   with the derivative   sum of w Z J^T,
//
// the weights w and the instruments Z (which stand for J where least squares would multiply r with it; in econometrics:
// instrumental variables) taken from an earlier rendering, the reference, and smoothed over neighbouring pixels as far
// as their noise asks for. Z need not be J for the right result; the nearer, the smaller the error. J itself is far
// noisier than r, and sum of J r would carry its noise times that of the target.
#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "runtime/inverse/forward_model.h"
#include "runtime/inverse/image_fit.h"
#include "runtime/inverse/image_loss.h"

namespace itn {

// s b, by channel: what the rendered image of target number `image` is multiplied by. parameters: of the unknowns.
std::array<double, 3> camera_factors(const std::vector<double>& x, std::size_t parameters, std::size_t image,
                                     bool white_balance);

// The noise of one image, an entry for each pixel and channel (as TargetImage::value).
struct PixelNoise {
  std::vector<double> sample, target;  // variance of one rendered sample of s T, and of the target
};

// rendering: of T; factors: camera_factors(). Smoothed over neighbours. Variance of the target: where its file has
// standard errors the variance of a sample, scaled to them on the whole; a camera's own; and relative_noise times the
// rendered radiance, squared.
PixelNoise noise_of(const Rendering& rendering, const TargetImage& target, const std::array<double, 3>& factors,
                    double relative_noise);

// Residual of the target over that noise. rendering: of other samples than those of the noise.
WhiteResidual white_residual(const Rendering& rendering, const TargetImage& target,
                             const std::array<double, 3>& factors, const PixelNoise& noise);

// The noise and the instruments that weigh one image's residuals.
struct Reference {
  PixelNoise noise;
  Eigen::MatrixXf instruments;  // a column for each pixel and channel: Z
};

// rendering: of the model of `target`, which is the image number `image`, at x; its samples are then not used again.
// white_balance: x ends with it.
Reference reference_of(const Rendering& rendering, const TargetImage& target, std::size_t image, double relative_noise,
                       const std::vector<Coordinate>& coordinates, const std::vector<double>& x,
                       bool white_balance = false);

// The equations of one rendering, at the unknowns that it was made with.
struct LeastSquares {
  double loss = 0, loss_stderr = 0;  // mean squared difference without the rendering's noise (as image_loss.h)
  double cost = 0;                   // mean of r^2 / variance; 1: what the noise explains
  double residuals = 0;              // pixels with weight and noise, times channels
  Eigen::VectorXd gradient;          // sum of w Z r
  Eigen::MatrixXd information;       // sum of w Z J^T
  // The rendering's noise in it, one matrix an unknown, D: that of u^T information v has the variance sum of v_k^2 u^T
  // D_k u. Derivatives by different unknowns have independent noise here, the channels of a pixel the same.
  std::vector<Eigen::MatrixXd> information_noise;
  Eigen::MatrixXd scale;  // sum of w Z Z^T: what the spread is where the noise is as it is said
  // Covariance of the gradient, from the scatter of its parts, one a pixel: it holds all noise, known or not. The fit
  // of the unknowns to these pixels is not accounted for.
  Eigen::MatrixXd spread;
  Eigen::MatrixXd monte_carlo;  // what the rendering has in it
};

// x: the unknowns; images: rendered at x, one a target, 2 samples a pixel or more.
LeastSquares least_squares(const std::vector<Rendering>& images, const std::vector<TargetImage>& targets,
                           const std::vector<Reference>& references, const std::vector<Coordinate>& coordinates,
                           const std::vector<double>& x, bool white_balance = false);

}  // namespace itn
