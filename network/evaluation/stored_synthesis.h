// Table 3's analysis by synthesis from one kind of start, stored in the report's folder (inversions_<start>.json) so
// that it goes on where it was stopped, with the same networks and options.
#pragma once
#include <string>

#include "network/evaluation/evaluate.h"
#include "runtime/base/stored_run.h"

namespace itn {

// Throws UsageError: the report's folder holds inversions that began with another network or other options; InputError:
// a file of them is damaged. starts: as choose_synthesis_targets() returned.
void require_same_syntheses(const EvaluationOptions& options, const Device& device, const Evaluation& e,
                            const std::vector<std::string>& starts);

class StoredSynthesis {
 public:
  // start: one of those that choose_synthesis_targets() returned. renderer and e must outlive this. Throws as
  // require_same_syntheses().
  StoredSynthesis(const EvaluationOptions& options, const Device& device, RenderedLoss& renderer, const Evaluation& e,
                  const std::string& start);

  bool finished() const { return synthesis_.finished(); }
  double fraction() const { return static_cast<double>(synthesis_.iteration()) / iterations_; }
  // One iteration or record; records are stored. Throws Interrupted: nothing has changed then, and store() keeps it.
  void advance();
  void store() const;
  SynthesisResult result() const { return {start_, synthesis_.records()}; }

 private:
  std::string start_;
  int iterations_;
  StoredRun::Json request_;  // all that the numbers depend on
  Synthesis synthesis_;
  StoredRun stored_;
};

}  // namespace itn
