// What one target says of materials, through an emulator of its image.
//
// From one half of the exemplars' samples come some twenty weighted sums of pixels: those combinations of fitted images
// (their coefficients as polynomials of the material) of which materials that are in question move the most over the
// noise that the sum has of the target. From the other half comes what each sum is at any material (polynomial_fit.h).
// Then the halves change places; both together weigh as much as one image. Of a target of no more values than that each
// value is compared.
#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "itn/target_image.h"
#include "runtime/inverse/posterior/exemplar.h"
#include "runtime/inverse/posterior/polynomial_fit.h"

namespace itn {

// A target, each value over the standard deviation of its noise.
struct WhiteTarget {
  int width = 0, height = 0, channels = 1;
  Eigen::VectorXf value, weight;  // weight: 1 / standard deviation, 0 where it is not compared
  Eigen::VectorXd deviation;      // of the noise
  std::vector<bool> is_noisy;     // a pixel each: false where its own noise is next to none, as behind the object
  bool noise_known = true;        // TargetNoise
};

// The noise's variance is the rendering's near the materials in question, scaled to what the target says of its own on
// the whole, and noise.relative times the radiance, squared. exemplars: near them; empty: the target's own, smoothed.
WhiteTarget white_target(const TargetImage& target, const std::vector<const ExemplarView*>& exemplars,
                         const TargetNoise& noise);

// Where emulators look: `wide`, all that is rendered; `local`, where materials are in question.
struct Regions {
  Frame wide, local;
  Eigen::MatrixXd samples;  // a column each: materials in question
  Eigen::VectorXd best;     // the likeliest of them; empty: not known yet
};

class EmulatedView {
 public:
  EmulatedView(const std::vector<Exemplar>& exemplars, std::size_t view, const WhiteTarget& target,
               const Regions& regions, const Polynomials& polynomials, bool exposure);

  // Log of the likelihood, with an unknown exposure integrated out (evenly in its logarithm). at: of the polynomials.
  double log_likelihood(const DesignPoint& at) const;
  struct Exposure {
    double mean = 1, deviation = 0;
  };
  // What the target says of its exposure, were that the material.
  Exposure exposure(const DesignPoint& at) const;

  // Variance of what is left of the target over that of its noise.
  double residual() const { return residual_; }
  // The emulator's part in the variance of the sums, by how much materials in question move them.
  double emulator_share() const;
  // Mean of PolynomialFit::leave_one_out over the sums.
  double leave_one_out() const;

 private:
  struct Half {
    Eigen::VectorXd target;  // the sums of the target, in which its noise has the variance 1
    Eigen::VectorXd moves;   // variance of each over the materials in question
    Eigen::MatrixXd mean;    // coefficients, a row a sum
    // Log of the emulator's variance as a polynomial of low degree, and between which numbers it was seen.
    Eigen::MatrixXd log_variance;
    Eigen::VectorXd least, most;
    // Of the emulator's errors of two sums: where its polynomials cannot follow the image they miss all sums alike.
    Eigen::MatrixXd correlation;
    double leave_one_out = 0;  // sum
    double typical_error = 0;  // variance
  };
  struct Compared;  // a half at a material
  Compared compare(const Half& half, const DesignPoint& at) const;
  void fit(Half& half, const std::vector<PolynomialFit>& fits, const Polynomials& polynomials,
           const Regions& regions) const;

  bool exposure_;
  double residual_ = 1;
  std::array<Half, 2> halves_;
};

}  // namespace itn
