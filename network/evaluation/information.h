// The most that an image can tell about its parameters: the Cramer-Rao bound.
//
// Pixels with independent normal noise of variance v have the information (Fisher) sum over pixels of dI_a dI_b / v; no
// unbiased estimate from the image has a covariance below its inverse. A bound beyond what is known without the image
// says nothing, so the prior's information (1 / variance of the training's parameters) is added: the inverse is then
// the covariance after seeing the image, as far as image and prior are normal.
#pragma once
#include <Eigen/Core>

#include "itn/renderer.h"

namespace itn {

// The information of one image, from renderings of it from different samples, equally many in each, with standard
// errors of the pixels and derivatives by the parameters, at the truth. Two or more make an estimate: products of
// derivatives are of two renderings, so that it has no bias from their noise. Pixels without variance are left out.
class FisherInformation {
 public:
  void add(const Rendering& rendering);
  void add(const FisherInformation& other);  // neither is without a rendering
  // The information of an image of `spp` samples a pixel.
  Eigen::MatrixXd of_image(int spp) const;

 private:
  Eigen::Index count_ = 0;
  // A column a pixel:
  Eigen::MatrixXd sum_, squares_;  // of the derivatives, and of their products (the matrix's columns on each other)
  Eigen::RowVectorXd variance_;    // sum of the variances of a sample
};

struct Bound {
  Eigen::VectorXd image;       // variances from the image alone; infinite where the information is not positive
  Eigen::VectorXd with_prior;  // variances, at most the prior's
};

// Do two estimates of the bound with prior differ by less than a factor of 1.5 in every standard deviation?
bool agree(const Bound& a, const Bound& b);

// prior: variances, > 0. Directions in which noise makes the information negative count as 0.
Bound cramer_rao(const Eigen::MatrixXd& information, const Eigen::VectorXd& prior);

}  // namespace itn
