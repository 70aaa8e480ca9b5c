// Analysis by synthesis (paper, section 6 and table 3): the parameters of many images at once, each by Adam on its own
// image loss (eq. 1), from given starts. Coordinates as in runtime/inverse: log sigma_t, logit of albedo and g.
//
// The loss that is recorded is not the one that is stepped on: it is rendered with more samples, the same random
// numbers for all iterations and starts, and less the variance of both images' noise (appearance.h), so its mean is
// that of images without noise.
#pragma once
#include <array>
#include <nlohmann/json.hpp>
#include <vector>

#include "network/dataset/rendered_loss.h"
#include "network/evaluation/appearance.h"
#include "network/evaluation/rerender.h"
#include "runtime/inverse/adam_step.h"
#include "runtime/inverse/coordinate.h"

namespace itn {

struct SynthesisOptions {
  int iterations = 200;
  int spp = 16;                 // of an iteration's gradient: 2 to 16, or a multiple of 16
  double learning_rate = 0.05;  // Adam's first; falls to 0 as a cosine, as in runtime/inverse
  int record_every = 10;
  int recorded_spp = 64;  // of a recorded loss; 2 or more
  std::uint64_t seed = 0;
};

// An image whose parameters are sought.
struct SynthesisTarget {
  Manifest::Image image;
  NoisyImage input;
};

class Synthesis {
 public:
  // State of every image before an iteration: iteration 0 is the start, options.iterations the end.
  struct Record {
    int iteration = 0;
    std::vector<DatasetMaterial> material;
    std::vector<double> loss;
  };

  // renderer, set and targets must outlive this; starts: one a target, in the parameters' ranges.
  Synthesis(RenderedLoss& renderer, const Manifest& set, const std::string& folder,
            const std::vector<SynthesisTarget>& targets, const std::vector<DatasetMaterial>& starts,
            const SynthesisOptions& options);

  bool finished() const { return iteration_ >= options_.iterations && recorded(); }
  // Records where it is time to, else makes one iteration. Throws Interrupted: nothing has changed then.
  void advance();
  int iteration() const { return iteration_; }
  const std::vector<Record>& records() const { return records_; }

  // All that advance() needs to go on with the same numbers.
  nlohmann::json state() const;
  // Throws nlohmann::json::exception and std::out_of_range: not such a state.
  void restore(const nlohmann::json& state);

 private:
  bool recorded() const { return !records_.empty() && records_.back().iteration == iteration_; }
  DatasetMaterial material(std::size_t image) const;
  std::vector<RerenderedImage> images(EvaluationStream stream, std::uint64_t first_index) const;
  void record();
  void step();

  RenderedLoss& renderer_;
  const Manifest& set_;
  const std::vector<SynthesisTarget>& targets_;
  SynthesisOptions options_;
  std::vector<Coordinate> coordinates_;
  std::vector<std::vector<double>> x_;  // by image: coordinates of sigma_t per scene unit, albedo, g
  std::vector<AdamMoments> moments_;
  std::vector<Record> records_;
  int iteration_ = 0;
};

}  // namespace itn
