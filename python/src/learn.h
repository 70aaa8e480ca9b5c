// Networks, their training and evaluation, and data sets.
#pragma once
#include <nanobind/nanobind.h>

namespace itn::python {

void bind_learn(nanobind::module_& module);

}  // namespace itn::python
