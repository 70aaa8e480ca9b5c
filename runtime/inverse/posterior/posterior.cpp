#include "runtime/inverse/posterior/posterior.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "runtime/base/parallel.h"
#include "runtime/inverse/posterior/low_discrepancy.h"

namespace itn {
namespace {

constexpr int design_spp = 32;                   // of a half, where nothing is known yet
constexpr int least_spp = 16, most_spp = 512;    // of a half
constexpr double least_samples_share = 1.0 / 8;  // of the samples that a target's noise asks for
constexpr double margin = 1.15;                  // of the frame about the samples of a broader density
// An emulator that makes a share s of the variance moves means by some sqrt(2 s) deviations from one round to the next.
constexpr double settled_share = 0.15;  // of the emulator
constexpr double settled_shift = 0.4;   // standard deviations
constexpr double settled_growth = 0.2;  // of log standard deviations
// Rounds that differ by less than a deviation are noisy answers to one question. Where they go on to differ until there
// are no more of them, the samples of the last two together are as wide as what they differ by.
constexpr double pooled_shift = 1, pooled_growth = 0.5;
// The likelier of several peaks may depend on changes of the image that are smaller than its noise. They show in
// renderings with this many times the samples, after this many rounds of them.
constexpr double samples_for_peaks = 8;
constexpr int rounds_for_peaks = 3;
constexpr int working_samples = 600;  // of the posterior, before the last round
constexpr Eigen::Index most_polynomials = 130;

// The fewest samples per pixel of a half from which the errors of a sum of few pixels are known. The errors of a few
// samples with heavy tails, as derivatives have, seem small where the samples happen to be small, and draw the fit
// there. Capped at what renders in no time.
int fewest_spp(const std::vector<TargetImage>& targets) {
  constexpr double enough = 4096, most = 1 << 20;  // samples of all values that are compared; of the whole image
  double result = least_spp;
  for (const TargetImage& target : targets) {
    const double compared = static_cast<double>(
        std::count_if(target.weight.begin(), target.weight.end(), [](float weight) { return weight > 0; }));
    const double wanted = enough / std::max(1.0, compared), all = static_cast<double>(target.weight.size());
    result = std::max(result, std::min(wanted, most / std::max(1.0, all)));
  }
  return static_cast<int>(std::ceil(result));
}

int design_size(Eigen::Index dimensions) { return 12 + 12 * static_cast<int>(dimensions); }
int refinement_size(Eigen::Index dimensions) { return 8 + 4 * static_cast<int>(dimensions); }

Eigen::VectorXd deviations(const Eigen::MatrixXd& samples) {
  const Eigen::MatrixXd centred = samples.colwise() - Eigen::VectorXd(samples.rowwise().mean());
  return (centred.rowwise().squaredNorm() / static_cast<double>(samples.cols())).cwiseSqrt();
}

}  // namespace

Posterior::Posterior(Eigen::Index dimensions, const std::vector<TargetImage>& targets, LogPrior log_prior,
                     const PosteriorOptions& options, std::vector<PosteriorRendering> renderings)
    : dimensions_(dimensions), targets_(targets), log_prior_(std::move(log_prior)), options_(options) {
  for (PosteriorRendering& rendering : renderings)
    if (rendering.at.cwiseAbs().maxCoeff() <= 1) renderings_.push_back(std::move(rendering));
  kept_ = renderings_.size();
  regions_.wide = regions_.local = Frame::whole(dimensions);
  regions_.samples.resize(dimensions, 256);
  for (Eigen::Index i = 0; i < regions_.samples.cols(); ++i)
    regions_.samples.col(i) = low_discrepancy_point(dimensions, static_cast<int>(i));
  want_design();
}

void Posterior::want_design() {
  const int spp = options_.spp > 0 ? std::max(1, std::min(design_spp, options_.spp / 2))
                                   : std::max(design_spp, fewest_spp(targets_));
  for (int i = 0; i < design_size(dimensions_); ++i) {
    const Eigen::VectorXd at = low_discrepancy_point(dimensions_, i);
    const bool there = std::any_of(renderings_.begin(), renderings_.end(), [&](const PosteriorRendering& r) {
      return (r.at - at).cwiseAbs().maxCoeff() < 1e-5;
    });
    if (!there) wanted_.push_back({at, spp});
  }
}

// As many samples as the targets have, by the noise of renderings near the posterior; less as long as the emulator's
// own error is greater than what they would save, more where there are peaks to be told apart.
int Posterior::refinement_spp() const {
  if (options_.spp > 0) return std::max(1, options_.spp / 2);
  constexpr std::size_t enough = 8;
  std::vector<std::pair<double, const PosteriorRendering*>> nearest;
  for (const PosteriorRendering& rendering : renderings_)
    nearest.emplace_back(regions_.local.reach(rendering.at), &rendering);
  std::stable_sort(nearest.begin(), nearest.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  nearest.resize(std::min(nearest.size(), enough));
  double wanted = 0, count = 0;
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    const TargetImage& target = targets_[t];
    double sample = 0, own = 0, rendered = 0, shown = 0;
    const auto halves = 2 * static_cast<double>(nearest.size());
    for (const auto& [reach, rendering] : nearest) {
      const RenderedView& view = rendering->views[t];
      for (const HalfImages& half : view.half)
        sample += static_cast<double>(half.error.row(0).squaredNorm()) * view.spp / halves;
      rendered += 2 * static_cast<double>(view.half[0].value.row(0).sum()) / halves;
    }
    for (const float v : target.value) shown += static_cast<double>(v);
    if (target.error.empty())
      for (const float v : target.value) own += std::pow(options_.noise.relative * static_cast<double>(v), 2);
    else
      for (const float e : target.error) own += static_cast<double>(e) * static_cast<double>(e);
    if (!options_.noise.known) own *= views_[t].residual();
    for (const float e : target.noise) own += static_cast<double>(e) * static_cast<double>(e);
    if (own > 0) {
      const double exposure = options_.exposure && rendered > 0 ? shown / rendered : 1;
      wanted += exposure * exposure * sample / own;
      ++count;
    }
  }
  const double spp = count > 0 ? wanted / count / 2 : most_spp;
  if (rounds_.back().peaks > 1)
    return std::max(fewest_spp(targets_), static_cast<int>(samples_for_peaks * std::min<double>(spp, most_spp)));
  const double saved = std::clamp(1 - rounds_.back().emulator_share, least_samples_share, 1.0);
  return std::max(fewest_spp(targets_), static_cast<int>(std::min<double>(saved * spp, most_spp)));
}

// Samples of the broader density that are far from each other and from what is rendered already. Renderings that were
// there at the beginning save new ones in the first refinement: no more are wanted than make it as dense as without
// them.
void Posterior::want_refinement() {
  const Eigen::MatrixXd& from = samples_.broad;
  const Frame& frame = regions_.local;
  const int spp = refinement_spp();
  std::vector<double> distance(static_cast<std::size_t>(from.cols()), std::numeric_limits<double>::infinity());
  const auto note = [&](const Eigen::VectorXd& at) {
    const Eigen::VectorXd w = frame.of(at);
    for (Eigen::Index i = 0; i < from.cols(); ++i) {
      double& d = distance[static_cast<std::size_t>(i)];
      d = std::min(d, (frame.of(from.col(i)) - w).squaredNorm());
    }
  };
  const auto note_those = [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i)
      if (renderings_[i].views.front().spp >= spp / 2) note(renderings_[i].at);
  };
  const auto farthest = [&] { return std::max_element(distance.begin(), distance.end()); };
  note_those(kept_, renderings_.size());
  const std::vector<double> without_kept = distance;
  for (int k = 0; k < refinement_size(dimensions_); ++k) note(from.col(farthest() - distance.begin()));
  const double dense = *farthest();
  distance = without_kept;
  note_those(0, kept_);
  while (static_cast<int>(wanted_.size()) < refinement_size(dimensions_) && *farthest() > dense) {
    wanted_.push_back({from.col(farthest() - distance.begin()), spp});
    note(wanted_.back().at);
  }
  kept_ = 0;  // what is not known then, they do not tell
}

void Posterior::emulate() {
  std::vector<std::size_t> local;
  for (std::size_t i = 0; i < renderings_.size(); ++i)
    if (regions_.local.near(renderings_[i].at)) local.push_back(i);
  const Eigen::Index pieces = static_cast<Eigen::Index>(local.size()) * (1 + dimensions_);
  polynomials_ = std::make_unique<Polynomials>(
      regions_.local, Polynomials::degree_for(dimensions_, std::min(most_polynomials, pieces)));
  std::vector<std::unique_ptr<EmulatedView>> made(targets_.size());
  parallel_for(targets_.size(), [&](std::size_t t) {
    std::vector<const RenderedView*> near;
    for (const std::size_t i : local)
      if (!rounds_.empty()) near.push_back(&renderings_[i].views[t]);
    const WhiteTarget target = white_target(targets_[t], near, options_.noise);
    made[t] = std::make_unique<EmulatedView>(renderings_, t, target, regions_, *polynomials_, options_.exposure);
  });
  views_.clear();
  for (const auto& view : made) views_.push_back(std::move(*view));
}

const PosteriorRound& Posterior::advance(std::vector<PosteriorRendering> rendered) {
  for (PosteriorRendering& rendering : rendered) renderings_.push_back(std::move(rendering));
  wanted_.clear();
  emulate();
  const LogDensity log_likelihood = [&](const Eigen::VectorXd& at) {
    const DesignPoint point(*polynomials_, at);
    double sum = 0;
    for (const EmulatedView& view : views_) sum += view.log_likelihood(point);
    return sum;
  };
  const Samples before = std::move(samples_);
  const auto how_many = [&](int count) {
    SamplerOptions how;
    how.samples = count;
    how.seed = options_.seed + rounds_.size();
    return how;
  };
  samples_ = sample_posterior(regions_.local, log_prior_, log_likelihood,
                              how_many(std::min(working_samples, options_.samples)));

  PosteriorRound round;
  round.renderings = static_cast<int>(renderings_.size());
  for (const PosteriorRendering& rendering : renderings_) round.local += regions_.local.near(rendering.at);
  round.mean = samples_.at.rowwise().mean();
  round.deviation = deviations(samples_.at);
  regions_.samples = samples_.broad;
  for (const EmulatedView& view : views_) {
    const auto count = static_cast<double>(views_.size());
    round.emulator_share += view.emulator_share() / count;
    round.leave_one_out += (view.leave_one_out() - 1) / count;
    round.residual += (view.residual() - 1) / count;
  }
  if (!rounds_.empty()) {
    const PosteriorRound& last = rounds_.back();
    round.shift = ((round.mean - last.mean).cwiseAbs().cwiseQuotient(round.deviation)).maxCoeff();
    round.growth = (round.deviation.cwiseQuotient(last.deviation)).array().log().cwiseAbs().maxCoeff();
    round.settled =
        round.shift <= settled_shift && round.growth <= settled_growth && round.emulator_share <= settled_share;
  }
  round.peaks = static_cast<int>(peaks_of(samples_.at, samples_.log_prior + samples_.log_likelihood).size());
  if (round.peaks > 1) {
    const auto with_peaks =
        std::count_if(rounds_.begin(), rounds_.end(), [](const PosteriorRound& r) { return r.peaks > 1; });
    round.settled = round.settled && with_peaks >= rounds_for_peaks;
  }
  const bool last_round = static_cast<int>(rounds_.size()) + 1 >= options_.rounds;
  if (last_round && !round.settled && !rounds_.empty() && round.peaks == 1 && rounds_.back().peaks == 1)
    round.settled = round.pooled =
        round.shift <= pooled_shift && round.growth <= pooled_growth && round.emulator_share <= settled_share;
  rounds_.push_back(round);
  done_ = round.settled || last_round;
  if (done_) {
    // Several peaks are sampled anew: the more samples there are from the beginning, the better their shares are known.
    const SamplerOptions how = how_many(options_.samples);
    samples_ = round.peaks > 1 ? sample_posterior(regions_.local, log_prior_, log_likelihood, how)
                               : more_samples(regions_.local, log_prior_, log_likelihood, how, samples_);
    if (round.pooled) pool(before, log_likelihood);
    peaks_ = peaks_of(samples_.at, samples_.log_prior + samples_.log_likelihood);
    return rounds_.back();
  }
  Eigen::Index best = 0;
  (samples_.log_prior + samples_.log_likelihood).maxCoeff(&best);
  regions_.best = samples_.at.col(best);
  regions_.local = Frame::around(samples_.broad, margin);
  want_refinement();
  return rounds_.back();
}

// Every second sample becomes one of the round before.
void Posterior::pool(const Samples& before, const LogDensity& log_likelihood) {
  const Eigen::Index pairs = samples_.at.cols() / 2;
  parallel_for(static_cast<std::size_t>(pairs), [&](std::size_t k) {
    const auto i = static_cast<Eigen::Index>(k);
    const Eigen::VectorXd at = before.at.col(i % before.at.cols());
    samples_.at.col(2 * i) = at;
    samples_.log_prior[2 * i] = log_prior_(at);
    samples_.log_likelihood[2 * i] = log_likelihood(at);
  });
}

EmulatedView::Exposure Posterior::exposure(std::size_t target, const Eigen::VectorXd& at) const {
  return views_[target].exposure(DesignPoint(*polynomials_, at));
}

}  // namespace itn
