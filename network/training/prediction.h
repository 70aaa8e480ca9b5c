// Predictions of a network for many examples, and their errors.
#pragma once
#include <vector>

#include "itn/network.h"
#include "network/training/examples.h"

namespace itn {

struct Predictions {
  std::size_t outputs = 1;
  std::vector<double> predicted, truth;  // parameters, (count, outputs)
};

// Throws InputError: numbers among the examples that are not finite.
Predictions predict(Network& network, const Examples& examples);

// Calibrated spread (NetworkDescription) of the network's distribution, from examples that it has not learnt from: with
// it each output's interval of 95 % holds 95 % of their true parameters (the order statistic of split conformal
// prediction: Lei et al. 2018). Fewer than 20 examples cannot tell; then it is 1. Throws as predict(), and UsageError:
// a network that predicts no distribution.
std::vector<double> calibrated_spread(Network& network, const Examples& held_out);

// For each output the root of the mean over the examples of (predicted - true)^2, in the parameter's units: the paper's
// table 1.
std::vector<double> root_mean_square_errors(const Predictions& predictions);

}  // namespace itn
