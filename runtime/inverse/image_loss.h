// The image loss of the paper (eq. 4: mean squared difference) and its gradient, both unbiased from the same paths.
//
// T, the rendered image, and dT, its derivative, are means over the same samples x_i, y_i, so (T - I) dT is biased by
// their covariance, as the paper's published code is. Products of different samples are not: with S = sum over samples,
// (S(x) S(y) - S(xy)) / (N (N - 1)) has the mean of T dT exactly (a U-statistic; so has T^2 with y = x). Here the
// products are of different groups of samples, up to 16 groups: at 16 samples and fewer that is every pair, above it at
// most 1/16 less.
#pragma once
#include <vector>

#include "itn/gradient_renderer.h"
#include "itn/renderer.h"
#include "itn/target_image.h"

namespace itn {

// Mean over pixels (by weight) and channels of (T - I)^2, and its gradient by the renderer's parameters, with standard
// errors (jackknife over the groups of each pixel; infinite with fewer than three samples a pixel).
struct LossGradient {
  double loss = 0, loss_stderr = 0;
  std::vector<double> gradient, gradient_stderr;
};

// groups: two or more renderings of different samples of the same image, as split_samples() says. exposure: what the
// rendered image is multiplied by. errors: false leaves the standard errors out (infinite), which take most of the
// time.
LossGradient loss_gradient(const std::vector<Rendering>& groups, const TargetImage& target, double exposure = 1,
                           bool errors = true);

// Weights for each value of each group's image: the sum of weight times derivative image is the gradient of
// loss_gradient (but for rounding), which GradientRenderer computes from them without derivative images. errors: false
// leaves out the contrasts for the standard errors, whose replays take about as long as the gradient's own.
GradientWeights loss_weights(const std::vector<Rendering>& groups, const TargetImage& target, double exposure = 1,
                             bool errors = true);

// The exposure with the smallest loss, sum of w T I / sum of w T^2, with an unbiased denominator: of order 1 / (pixels
// times samples) off. With it held fixed, loss_gradient is the gradient of the smallest loss (envelope theorem). Throws
// ResultError: a black image or target, or one lost in noise. channel: of it alone; -1: of all.
double best_exposure(const std::vector<Rendering>& groups, const TargetImage& target, int channel = -1);

// Number of samples of each group; spp >= 2.
std::vector<int> split_samples(int spp);

// The mean over several images of one scene.
LossGradient mean_of(const std::vector<LossGradient>& images);

}  // namespace itn
