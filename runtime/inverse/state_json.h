// The state of an optimizer as JSON, from which it goes on with the same numbers.
#pragma once
#include <nlohmann/json.hpp>

#include "runtime/inverse/gauss_newton/inversion.h"

namespace itn {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(AdamMoments, first, second)

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(InversionState, iteration, spp, next_sample, x, done, converged, joined, reference_x,
                                   accepted_x, reference_spp, reference_sample, accepted_loss, accepted_loss_stderr,
                                   damping, accepted, pool, moments)

}  // namespace itn
