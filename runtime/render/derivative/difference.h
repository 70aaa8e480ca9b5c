// Central differences of rendered images, and whether a derivative agrees with them. Knows no derivative of any model.
#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "itn/parameters.h"

namespace itn {

// d f / d parameter ~ sum of weight * f(value + offset).
struct DifferenceStencil {
  std::array<double, 4> offset{}, weight{};
  double step = 0;  // the largest |offset|
};

// Inside of the range: central differences with step h and h/2, Richardson-extrapolated, error of order h^4; h is a
// tenth of the distance to the nearer end of the range (for g = 0.5: 0.05; for sigma_t = 10: 1), and at most a fifth of
// the distance to a kink of the image: for an index of refraction the one across the boundary, for the turbidity the
// next whole number. On a kink: the mean of the derivatives on both sides, error of order h^2. At an end of the range:
// one-sided, four points, error of order h^3, h = 1.5 % of the range.
DifferenceStencil difference_stencil(const Scene& scene, const Parameter& parameter);

// The scene with the parameter moved; light is sampled as before, so that paths of the same random numbers stay.
// Throws UsageError: outside of the range.
Scene moved_scene(const Scene& scene, const Parameter& parameter, double offset);

// Independent batches of a derivative image and of a difference image from the same random numbers.
class DerivativeComparison {
 public:
  // pixels of `channels` interleaved channels.
  DerivativeComparison(std::size_t pixels, std::size_t channels);

  // One batch; both: pixels * channels numbers.
  void add(const std::vector<float>& derivative, const std::vector<double>& difference);

  struct Channel {
    // Derivatives of the image mean; the standard errors assume that pixels are independent.
    double derivative = 0, derivative_stderr = 0, difference = 0, difference_stderr = 0;
    double stderr_between = 0;  // of derivative - difference, which share their random numbers
    double z = 0;               // (derivative - difference) / stderr_between; infinite or NaN when a number is
    // Pixels of which a number is not 0 but for rounding, and the share of them whose own derivative and difference
    // differ by more than the 95 % limit of Student's t: about 0.05, less where few paths carry the derivative.
    std::size_t pixels = 0;
    double beyond_95 = 0;
  };

  // rounding: a standard error [unit of the derivative] to add: see rounding_error. Needs at least two batches.
  std::vector<Channel> result(double rounding) const;

 private:
  struct Sums {
    double derivative = 0, derivative_2 = 0, difference = 0, difference_2 = 0, between = 0, between_2 = 0;
  };
  std::size_t channels_, batches_ = 0;
  std::vector<Sums> sums_;
};

// Standard error [unit of the derivative] that single precision leaves in the difference of images with that mean: half
// a unit in the last place.
double rounding_error(const DifferenceStencil& stencil, double mean_of_image);

}  // namespace itn
