// A network that predicts its own uncertainty (NetworkDescription::distribution): its prediction is a normal
// distribution of the outputs' shares (output_range.h), so of log sigma_t, albedo and g between the ends of their
// ranges, with all correlations. Shares, not raw outputs: the share of a material at the end of a range is 0 or 1, its
// raw output infinite.
//
// Raw outputs of one image, n parameters:
//   z[i]                i < n   mean share = logistic(z[i])
//   s[i]                n more  its standard deviation = spread[i] e^s[i] / sqrt(12): that of a uniform share at 0
//   a[i, j], j < i      n (n - 1) / 2 more, by rows: correlations. With a[i, i] = 1 and rows scaled to length 1, a is
//                       the Cholesky factor of the correlation matrix
//
// spread is what calibration on held-out examples found (NetworkDescription::spread).
#pragma once
#include <span>
#include <vector>

#include "itn/loss.h"
#include "itn/network.h"

namespace itn {

// Predicted distribution of one image. The shares are mean + diag(deviation) factor w, with w independent and standard
// normal; outside of [0, 1] they are outside of the ranges, where no material is.
struct ShareDistribution {
  std::vector<double> mean, deviation;
  std::vector<double> factor;  // (n, n), row-major, lower triangular, rows of length 1
};

// raw: of one image. Throws UsageError: a network that says no distribution.
ShareDistribution share_distribution(std::span<const float> raw, const NetworkDescription& network);

// Interval of a parameter with a probability of 95 %: the normal distribution's quantiles, cut off at the range's ends.
struct ParameterEstimate {
  double value = 0;          // at the mean share
  double low = 0, high = 0;  // NaN of a network that says no distribution
};

// Estimates for one image, one an output.
std::vector<ParameterEstimate> estimates_of(std::span<const float> raw, const NetworkDescription& network);

// Minus the log of the density at the truth, mean over batch and outputs, and its gradient by the raw outputs; spreads
// count as 1. Laid out as supervised_loss().
OutputLoss likelihood_loss(std::span<const float> outputs, std::span<const double> truth,
                           const std::vector<OutputRange>& ranges);

// The truth of one image relative to the predicted distribution.
struct Calibration {
  std::vector<double> score;  // of each output: (true share - mean) / deviation, standard normal where calibrated
  double distance = 0;  // squared, in standard deviations along all directions: chi-square of n degrees of freedom
};
Calibration calibration_of(std::span<const float> raw, std::span<const double> truth,
                           const NetworkDescription& network);

// Squared distances below this are in the joint region of 95 %. n: outputs, 1 or more.
double joint_region(std::size_t n);

}  // namespace itn
