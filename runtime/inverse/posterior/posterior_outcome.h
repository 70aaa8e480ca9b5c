// The outcome of an inversion by method posterior: numbers, text, a table of samples and a page.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runtime/inverse/gauss_newton/inversion_outcome.h"
#include "runtime/inverse/posterior/stored_posterior.h"

namespace itn {

struct PosteriorOutcome {
  InversionQuestion question;
  std::vector<std::string> names;            // parameters, then "exposure 0" and so on
  std::vector<std::vector<double>> samples;  // of each name: values
  std::vector<int> peak_of;                  // of each sample; -1: none that counts
  std::vector<double> log_density;
  std::vector<Interval> parameters, coefficients, exposures;  // value: the mean; stderr_: the standard deviation
  Eigen::MatrixXd correlation;                                // of the parameters
  std::vector<Direction> directions;
  struct PeakValues {
    double share = 0;
    std::vector<Interval> parameters;
  };
  std::vector<PeakValues> peaks;
  std::vector<PosteriorRound> rounds;
  std::vector<NaturalRange> ranges;
  std::size_t found = 0, made = 0;
  double loss = 0, loss_stderr = 0, residual = 1;
  std::vector<Rendering> images;  // of the likeliest sample
  std::vector<WhiteResidual> white;
  ImageFit fit;
  Misfit misfit;
  double seconds = 0;

  bool settled() const { return rounds.back().settled; }
  // The rest that the likeliest image leaves is noise as large as was said. Before it has settled intervals are wider,
  // not wrong: they count in what the emulator does not know.
  bool intervals_hold() const { return fit.fits(); }
  bool converged() const { return settled() && fit.fits(); }
};

// Renders the likeliest sample. scene: what was inverted. Throws Interrupted.
PosteriorOutcome conclude(const InversionQuestion& question, const StoredPosterior& stored, ForwardModel& model,
                          const std::vector<NaturalRange>& ranges, Scene scene, const std::vector<TargetImage>& targets,
                          const PosteriorOptions& options);

nlohmann::ordered_json to_json(const PosteriorOutcome& outcome, const std::vector<Coordinate>& coordinates);
std::vector<std::string> verdict(const PosteriorOutcome& outcome);
std::string failure(const PosteriorOutcome& outcome);
std::vector<std::string> ambiguity_words(const PosteriorOutcome& outcome, const std::vector<Coordinate>& coordinates);

// result.json, samples.csv, rerender.exr, pictures and report.html in question.folder. Throws ResultError.
void write_posterior(const PosteriorOutcome& outcome, const std::vector<Coordinate>& coordinates,
                     const std::vector<TargetImage>& targets);

}  // namespace itn
