// An inversion from one start, and how it is stored.
#pragma once
#include <nlohmann/json.hpp>
#include <vector>

#include "runtime/base/stored_run.h"
#include "runtime/inverse/gauss_newton/inversion.h"

namespace itn {

// One start and how far it has come.
struct StartedInversion {
  std::vector<double> start;  // coordinates
  InversionState state;
  std::vector<InversionStep> steps;
};

nlohmann::json stored_json(const StartedInversion& run);

// The runs that were stored. Throws InputError: they are damaged, or no inversions of so many coordinates and unknowns
// (coordinates and exposures) from at most so many starts.
struct InversionSizes {
  std::size_t coordinates = 0, unknowns = 0, starts = 0;
};
std::vector<StartedInversion> started_inversions(const StoredRun& run, const InversionSizes& sizes);

}  // namespace itn
