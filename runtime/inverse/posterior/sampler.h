// Samples of a density in the cube [-1, 1]^d, or in a part of it: sequential Monte Carlo (Del Moral, Doucet, Jasra
// 2006) from a prior to the posterior through powers of the likelihood, so that it finds peaks wherever they are. Moves
// are those of differential evolution (ter Braak 2006), which jump between peaks too.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>

#include "runtime/inverse/posterior/polynomials.h"

namespace itn {

struct SamplerOptions {
  int samples = 1000;
  std::uint64_t seed = 0;
  double broad = 0.25;  // the power of the likelihood of Samples::broad
  int moves = 4;        // at least, between powers
};

struct Samples {
  Eigen::MatrixXd at;  // a column each
  Eigen::VectorXd log_prior, log_likelihood;
  Eigen::MatrixXd broad;    // of a wider density than the posterior
  double acceptance = 0;    // of the last moves
  double log_evidence = 0;  // of the likelihood, over the prior as it is
};

using LogDensity = std::function<double(const Eigen::VectorXd&)>;

// frame: where the posterior lies, outside of which it is not looked for. The functions are called from several
// threads.
Samples sample_posterior(const Frame& frame, const LogDensity& log_prior, const LogDensity& log_likelihood,
                         const SamplerOptions& options);

// options.samples of the same density from those that sample_posterior() has drawn: each moved on from one of them. As
// many as these were from the prior on cost ten times as much; how much each separate peak has stays as it is there.
Samples more_samples(const Frame& frame, const LogDensity& log_prior, const LogDensity& log_likelihood,
                     const SamplerOptions& options, const Samples& from);

}  // namespace itn
