// Models with as many parameters as a scene gives them. Each size is made once.
#pragma once
#include <cstddef>

#include "itn/model.h"

namespace itn {

// sphericalharmonics up to an order: its parameters are c_l_m, for l = 0 ... order and m = -l ... l.
const Model& spherical_harmonics_model(int order);
int spherical_harmonics_order(const Model& model);

// tabphase of so many values, 2 to TABULATED_MOST: value_0, value_1, ... (kernels/model/phase/tabulated.h).
const Model& tabulated_model(std::size_t values);

// Nests, whose numbers are the shares of what is inside. dictionary, around so many BSDFs or phase functions: its
// parameters are weight_0, weight_1, ...; blendphase: around two, by one weight.
const Model& dictionary_model(std::size_t entries);
const Model& blend_phase_model();

}  // namespace itn
