// The parts of `itn eval`, each a table of the paper.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tools/common.h"
#include "tools/eval_result.h"

namespace itn::tools {

struct EvalOptions {
  CommonOptions common;
  std::string data, report;
  std::vector<std::string> runs;
  int images = 120, inversions = 10, iterations = 200;
  double learning_rate = 0.05;
  std::optional<int> threads;
};

// Table 1: what all runs say about all images of the training and of the test splits. Throws InputError: an image that
// cannot be read, a set without training or test images; Interrupted.
void predict_splits(const EvalOptions& options, Evaluation& e);

// Table 2 and the information limit: some of these images rendered again.
void rerender_predictions(const EvalOptions& options, RenderedLoss& renderer, Evaluation& e);

// The information limit of each of these images.
std::vector<Bound> find_bounds(const EvalOptions& options, RenderedLoss& renderer, const Evaluation& e,
                               const std::vector<const Manifest::Image*>& records);

// Table 3, and the information limit of its images. Keeps what it has in REPORT/inversions_<start>.json, also when it
// is interrupted, and goes on from there if that was for the same question.
void run_syntheses(const EvalOptions& options, const Device& device, RenderedLoss& renderer, Evaluation& e);

}  // namespace itn::tools
