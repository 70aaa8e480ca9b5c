// Rendered images against targets as a weighted least-squares problem: what Gauss-Newton solves, and what tells how well
// the parameters are known.
//
// Unknowns: the coordinates of the parameters, then, where the exposures are unknown, log s of every target (the model
// of a target is s T). r = s T - I, J = d (s T) / d unknown. Products of two rendered things take them from different
// samples (image_loss.h), so gradient and information have no bias at any number of samples.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "runtime/inversion/forward_model.h"
#include "runtime/inversion/image_loss.h"

namespace itn {

// Variances, one a pixel and channel: of one rendered sample, and of the target.
struct NoiseModel {
  std::vector<double> sample, target;
};

// From a rendering whose samples are then not used again: weights that know the noise of what they weigh would pull
// towards pixels that happen to be quiet, and so dark. Samples: variance between the groups, mean of 3 x 3 pixels.
// Target: where its file has standard errors the variance of a sample, scaled to them on the whole; and relative_noise
// times the rendered radiance, squared.
NoiseModel noise_model(const std::vector<Rendering>& groups, const TargetImage& target, double relative_noise,
                       double exposure);

constexpr std::size_t information_parts = 32;

// The equations of one rendering, at the unknowns that it was made with.
struct LeastSquares {
  double loss = 0, loss_stderr = 0;  // mean squared difference (image_loss.h)
  double cost = 0, cost_stderr = 0;  // mean of r^2 / variance; 1: what the noise explains
  double residuals = 0;              // pixels with weight and noise, times channels
  Eigen::VectorXd gradient;          // sum of r J / variance
  // Sum of J J^T / variance, of 32 interleaved sets of pixels: their differences are its noise.
  std::vector<Eigen::MatrixXd> information;
  Eigen::MatrixXd plug_in;      // the same of all pixels and from means alone: positive, and too large by the noise of J
  Eigen::MatrixXd spread;       // of the gradient, from its parts, one a pixel: all noise that there is, known or not
  Eigen::MatrixXd monte_carlo;  // what the rendering has in it, from its groups of samples
};

// x: the unknowns; images: rendered at x.
LeastSquares least_squares(const std::vector<std::vector<Rendering>>& images, const std::vector<TargetImage>& targets,
                           const std::vector<NoiseModel>& noise, const std::vector<Coordinate>& coordinates,
                           const std::vector<double>& x);

}  // namespace itn
