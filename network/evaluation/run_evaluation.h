// All parts of an evaluation that were asked for, one after the other.
#pragma once
#include <atomic>
#include <functional>
#include <string>

#include "network/evaluation/evaluate.h"

namespace itn {

// Reports progress to a display. All functions may be called many times; none may be empty.
struct EvaluationProgress {
  // A part begins: so many units, of which the fraction `done` was there already. stored: interrupted, it goes on where
  // it was.
  std::function<void(const std::string& label, double amount, const std::string& unit, double done, bool stored)> begin;
  std::function<void(double)> update;  // the fraction of the part
  std::function<void()> end;
};

// e: as begin_evaluation() returned it. device: as for Device. Throws as the parts, and Interrupted soon after cancel
// is set; what there is of the inversions is then stored.
void run_evaluation(const EvaluationOptions& options, const std::string& device, const std::atomic<bool>& cancel,
                    const EvaluationProgress& progress, Evaluation& e);

}  // namespace itn
