// The posterior of a scene's parameters: rounds of renderings at materials that are in question, an emulator of the
// targets from all of them (emulated_view.h), samples of the posterior, and again where these are, until mean and width
// stay.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "runtime/inverse/posterior/emulated_view.h"
#include "runtime/inverse/posterior/peaks.h"
#include "runtime/inverse/posterior/sampler.h"

namespace itn {

struct PosteriorOptions {
  int rounds = 8;      // at most
  int spp = 0;         // of a rendering, both halves; 0: as the targets' noise asks for
  int samples = 2000;  // of the posterior
  std::uint64_t seed = 0;
  TargetNoise noise;
  bool exposure = false;
};

struct PosteriorRound {
  int renderings = 0, local = 0;    // all; those that the last emulator uses
  Eigen::VectorXd mean, deviation;  // natural coordinates
  double shift = 0, growth = 0;  // greatest change of means in deviations, and of log deviations, since the last round
  double emulator_share = 0;     // of the emulator in the variance of what is compared
  double leave_one_out = 1, residual = 1;
  int peaks = 1;
  bool settled = false;
  bool pooled = false;  // the answer is the samples of this round and the last one together
};

// Renders the targets' views at natural coordinates, `spp` samples in each of both halves.
using RenderAt = std::function<PosteriorRendering(const Eigen::VectorXd& at, int spp)>;
using LogPrior = std::function<double(const Eigen::VectorXd& at)>;

class Posterior {
 public:
  // targets must outlive it. renderings: what has been rendered already, of any materials; those outside of the cube
  // are left out.
  Posterior(Eigen::Index dimensions, const std::vector<TargetImage>& targets, LogPrior log_prior,
            const PosteriorOptions& options, std::vector<PosteriorRendering> renderings = {});

  // Another rendering is needed: where, and with how many samples in each half.
  struct Wanted {
    Eigen::VectorXd at;
    int spp = 0;
  };
  bool done() const { return done_; }
  // The renderings that this round needs, in the order in which advance() takes them; none once it is done.
  const std::vector<Wanted>& wanted() const { return wanted_; }
  // All that were wanted, in their order: ends the round.
  const PosteriorRound& advance(std::vector<PosteriorRendering> rendered);

  const std::vector<PosteriorRound>& rounds() const { return rounds_; }
  const Samples& samples() const { return samples_; }
  const std::vector<Peak>& peaks() const { return peaks_; }
  const std::vector<PosteriorRendering>& renderings() const { return renderings_; }
  // The exposure of a target, for the material `at`.
  EmulatedView::Exposure exposure(std::size_t target, const Eigen::VectorXd& at) const;

 private:
  void want_design();
  void want_refinement();
  int refinement_spp() const;
  void emulate();
  void pool(const Samples& before, const LogDensity& log_likelihood);

  Eigen::Index dimensions_;
  const std::vector<TargetImage>& targets_;
  LogPrior log_prior_;
  PosteriorOptions options_;
  std::vector<PosteriorRendering> renderings_;
  std::size_t kept_ = 0;  // of them, which were there at the beginning
  std::vector<Wanted> wanted_;
  std::vector<PosteriorRound> rounds_;
  std::unique_ptr<Polynomials> polynomials_;
  std::vector<EmulatedView> views_;
  Regions regions_;
  Samples samples_;
  std::vector<Peak> peaks_;
  bool done_ = false;
};

}  // namespace itn
