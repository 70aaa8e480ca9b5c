// Writes the files that an inversion leaves in its folder beside its state: result.json, images, pictures, report.html.
#pragma once
#include <vector>

#include "runtime/inverse/gauss_newton/inversion_outcome.h"

namespace itn {

// Throws ResultError where the folder takes no files.
void write_inversion(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates,
                     const std::vector<TargetImage>& targets);

}  // namespace itn
