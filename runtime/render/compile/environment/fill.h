// Functions that each environment of kernels/model/environment/list.h has to fill the device's records of the scene's
// light, and helpers that their files share.
#pragma once
#include <fmt/core.h>

#include <cmath>
#include <vector>

#include "itn/error.h"
#include "kernels/model/models.h"
#include "runtime/render/compile/environment.h"

namespace itn {

// name_fill: the record's numbers, but model and to_local; appends what has no fixed size to the tables of all records.
// Throws InputError. name_move: `moving`, a record that name_fill filled, becomes its derivative by the parameter.
#define ITN_ENVIRONMENT_FUNCTIONS(name, PREFIX, type)                                                      \
  void name##_fill(const Environment& environment, EnvironmentRecord& record, std::vector<float>& tables); \
  void name##_move(const Environment& environment, const Parameter& p, EnvironmentRecord& moving,          \
                   std::vector<float>& tables);
ENVIRONMENT_LIST(ITN_ENVIRONMENT_FUNCTIONS)
#undef ITN_ENVIRONMENT_FUNCTIONS

// "file:line:column: turbidity of the sunsky emitter must be in [1, 10]; got 11"
template <class Value>
[[noreturn]] void refuse(const Environment& environment, const char* parameter, const char* need, const Value& got,
                         const char* remedy = "") {
  const auto& at = environment.where;
  throw InputError(fmt::format("{}:{}:{}: {} of the {} emitter must be {}; got {}{}{}", at.file, at.line, at.column,
                               parameter, environment.type(), need, got, *remedy ? ": " : "", remedy));
}
template <class Value>
void require(bool good, const Environment& environment, const char* parameter, const char* need, const Value& got,
             const char* remedy = "") {
  if (!good) refuse(environment, parameter, need, got, remedy);
}
inline bool not_negative(double x) { return x >= 0 && std::isfinite(x); }

// A sampling table (kernels/model/environment/sampling_table.h). weight: the light of each cell, row by row. Returns
// where it begins.
int append_sampling(const std::vector<double>& weight, std::size_t rows, std::size_t columns,
                    std::vector<float>& tables);
double sum(const std::vector<double>& values);

// The derivative of what is linear in `radiance` by that parameter itself.
void move_radiance(const Parameter& p, EnvironmentRecord& moving);

}  // namespace itn
