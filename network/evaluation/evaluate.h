// The parts of an evaluation, each a table of the paper: trained networks compared on a data set.
//
//   Evaluation e = begin_evaluation(options);
//   predict_splits(options, e, cancel, progress);                          table 1
//   choose_rerendered(options, e, cancel);
//   rerender_predictions(options, renderer, e, progress);                  table 2
//   bound_rerendered(options, renderer, e, progress);                      the information limit
//   for (start : choose_synthesis_targets(options, e)) { StoredSynthesis ... }   table 3
//   bound_syntheses(options, renderer, e, progress);
//   write_evaluation(options.report, e);                                   report.h
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "network/evaluation/evaluation.h"

namespace itn {

struct EvaluationOptions {
  std::string data;               // folder of a complete data set
  std::vector<std::string> runs;  // trained networks (include/itn/trained_network.h)
  std::string report;             // folder, which must be there for table 3
  int images = 120;               // test images of table 2, and a quarter as many of the training
  int inversions = 10;            // images of every test shape in table 3
  int iterations = 200;           // of Adam, in table 3
  double learning_rate = 0.05;    // its first; falls to 0 as a cosine
  int spp = 0;                    // of table 2, 2 or more; 0: the data set's
  std::uint64_t seed = 0;
};

// Called now and then with the share of the part that is done; may be empty.
using Fraction = std::function<void(double)>;

// Reads set and networks. Throws InputError, and what read_run() throws.
Evaluation begin_evaluation(const EvaluationOptions& options);

// Table 1: what all runs say about all images of the training and of the test splits. Throws InputError: an image that
// cannot be read, a set without test images; Interrupted soon after cancel is set.
void predict_splits(const EvaluationOptions& options, Evaluation& e, const std::atomic<bool>& cancel,
                    const Fraction& progress);

// Table 2: chooses some of these images. Throws as predict_splits().
void choose_rerendered(const EvaluationOptions& options, Evaluation& e, const std::atomic<bool>& cancel);
// Renders them with what the runs predict, and with the truth. Throws Interrupted.
void rerender_predictions(const EvaluationOptions& options, RenderedLoss& renderer, Evaluation& e,
                          const Fraction& progress);

// The information limit of table 2's images, and of table 3's. Throws Interrupted.
void bound_rerendered(const EvaluationOptions& options, RenderedLoss& renderer, Evaluation& e,
                      const Fraction& progress);
void bound_syntheses(const EvaluationOptions& options, RenderedLoss& renderer, Evaluation& e, const Fraction& progress);

// Table 3: chooses its images. Returns the names of the starts: rn and itn as far as there are runs, and truth. Throws
// InputError: an image that cannot be read, no images of test shapes.
std::vector<std::string> choose_synthesis_targets(const EvaluationOptions& options, Evaluation& e);

}  // namespace itn
