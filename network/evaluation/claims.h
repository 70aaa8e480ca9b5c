// Tests the paper's claims on the networks at hand.
#pragma once
#include <string>
#include <vector>

#include "network/evaluation/evaluation.h"

namespace itn {

struct Claim {
  enum class Verdict { holds, fails, open };
  std::string text;  // the claim, with figures
  Verdict verdict = Verdict::open;
  Estimate estimate;  // a ratio
  double bound = 1;   // the claim is that the ratio is below it
};

// "holds", "does not hold", "cannot be told at this size".
std::string verdict_words(Claim::Verdict verdict);

// A claim about kinds that have no runs, or a table that was left out, is left out.
std::vector<Claim> claims_of(const Evaluation& e);

// After how many iterations the median of ITN's starts is where RN's is at the end; -1: never. what: as
// Evaluation::synthesis_errors().
int iterations_to_reach(const Evaluation& e, std::size_t what);

}  // namespace itn
