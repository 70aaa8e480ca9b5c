// From the light of a scene file to what the device reads.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "itn/parameters.h"
#include "itn/scene.h"
#include "kernels/shared/environment_layout.h"

namespace itn {

// Fills the record; appends its pixels and sampling tables to the array that all records share. Throws InputError.
void append_environment(const Environment& environment, EnvironmentRecord& record, std::vector<float>& tables);

// The record that stands for d radiance / d parameter in kernels/light/emission.h: `record`, which append_environment
// filled, with derivatives in place of the numbers that radiance is made of. parameter: of this environment; may append
// to tables.
EnvironmentRecord environment_derivative(const Environment& environment, const Parameter& parameter,
                                         const EnvironmentRecord& record, std::vector<float>& tables);

// Appends a cumulative distribution over n cells (uniform when all weights are 0): n + 1 multiples of 2^-24, the grid
// of the random numbers, so that a cell's probability is the difference of its bounds exactly. Every cell with a weight
// can be drawn.
void append_cumulative(const double* weight, std::size_t n, std::vector<float>& tables);

// Would light sampling find what chance does not?
bool is_uneven(const EnvironmentRecord& record);

// The definitions with which kernels/light/environment.h serves all of these records.
std::map<std::string, std::string> environment_definitions(const std::vector<EnvironmentRecord>& records);

}  // namespace itn
