// The findings of an evaluation, before they are put into words.
#pragma once
#include <array>
#include <map>
#include <string>
#include <vector>

#include "itn/distribution.h"
#include "network/evaluation/appearance.h"
#include "network/evaluation/bootstrap.h"
#include "network/evaluation/evaluated_run.h"
#include "network/evaluation/information.h"
#include "network/evaluation/synthesis.h"

namespace itn {

// A split's images, and what every run says about each.
struct SplitPredictions {
  Manifest::Split split = Manifest::Split::train;
  std::vector<Manifest::Image> images;
  std::vector<std::vector<DatasetMaterial>> predicted;  // by run, then image
  std::vector<std::vector<Calibration>> calibration;    // likewise; a run that says no distribution has none
};

// Coverage of the intervals: over the images of a ParameterErrors, by kind. Kinds of which a run predicts no
// distribution are left out.
struct Coverage {
  static constexpr std::size_t bins = 10;
  std::array<Runs, 4> held;  // 1 where the interval of 95 % holds the truth, else 0: each parameter; all jointly
  // For each parameter, over all runs: the number of images whose truth lies in each tenth of the predicted
  // distribution, from the low end.
  std::array<std::array<std::size_t, bins>, 3> ranks{};
};

// Table 1: squared errors of some images, summed by shape and light. Keys: the kinds, and "constant", the mean of the
// training's parameters.
struct ParameterErrors {
  std::string name;  // training, testing (all images of unseen shape, light, or both), or a split
  std::size_t images = 0, cells = 0;
  std::map<std::string, std::array<Runs, 3>> squares;
  std::map<std::string, Coverage> coverage;
};

// Table 2: an image rendered with the parameters that every run predicts, and with its own.
struct RerenderedResult {
  SynthesisTarget target;
  bool training = false;
  std::vector<DatasetMaterial> predicted;  // by run
  std::vector<Difference> difference;      // by run
  Difference truth;
  Bound bound;                            // what the image can tell
  std::vector<std::vector<float>> image;  // by run; only of images to show
};

// Table 3: analysis by synthesis from one kind of start.
struct SynthesisResult {
  std::string start;  // rn, itn, truth
  std::vector<Synthesis::Record> records;
};

struct Evaluation {
  std::string folder;
  Manifest set;
  std::vector<EvaluatedRun> runs;
  std::vector<Kind> kinds;
  Resampling resampling;
  std::array<double, 3> constant{}, prior{};  // mean and variance of the training's parameters
  std::vector<SplitPredictions> splits;
  std::vector<ParameterErrors> errors;
  int spp = 0;  // of the images rendered again
  std::vector<RerenderedResult> rerendered;
  SynthesisOptions synthesis_options;
  std::vector<SynthesisTarget> synthesis_targets;
  std::vector<Bound> synthesis_bounds;  // of each
  std::vector<SynthesisResult> syntheses;
  double seconds = 0;

  const Kind* kind(const std::string& name) const;
  const ParameterErrors* errors_of(const std::string& subset) const;
  const SynthesisResult* synthesis(const std::string& start) const;

  // Table 2's numbers, summed by shape and light. structure: 1 - MS-SSIM, else mean squared differences. who: a kind,
  // or "truth".
  Runs appearance(const std::string& who, bool training, bool structure) const;

  // Table 3's: squared errors of log sigma_t, albedo, g (0 ... 2) or the image loss (3) of every image.
  std::vector<double> synthesis_errors(const Synthesis::Record& record, std::size_t what) const;

  // Median squared error of log sigma_t, albedo or g that the noise of the input images alone makes: infinite where it
  // hides a direction in most images.
  double synthesis_limit(std::size_t what) const;
};

// A number for each combination of shape and light.
std::size_t cell_of(const Manifest& set, const Manifest::Image& image);

}  // namespace itn
