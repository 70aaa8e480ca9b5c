// What an image can tell about its parameters at most: the Cramer-Rao bound.
//
// Pixels with independent normal noise of variance v have the information (Fisher) sum over pixels of dI_a dI_b / v; no
// unbiased estimate from the image has a covariance below its inverse. A bound beyond what is known without the image
// says nothing, so the prior's information (1 / variance of the training's parameters) is added: the inverse is then
// the covariance after seeing the image, as far as image and prior are normal.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "runtime/renderer.h"

namespace itn {

// groups: three or more renderings of one image from different samples, equally many in each, with standard errors of
// the pixels and derivatives by the parameters, at the truth. spp: samples a pixel of the image that is asked about.
// Products of derivatives are of two groups, and what divides them is the variance of the others' pixels, so that the
// result has no bias from what these have in common. Pixels without variance are left out.
Eigen::MatrixXd fisher_information(const std::vector<Rendering>& groups, int spp);

struct Bound {
  Eigen::VectorXd image;       // variances from the image alone; infinite where the information is not positive
  Eigen::VectorXd with_prior;  // variances, at most the prior's
};

// prior: variances, > 0. Directions in which noise makes the information negative count as 0.
Bound cramer_rao(const Eigen::MatrixXd& information, const Eigen::VectorXd& prior);

}  // namespace itn
