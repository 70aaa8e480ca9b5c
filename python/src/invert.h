// From images to parameters.
#pragma once
#include <nanobind/nanobind.h>

namespace itn::python {

void bind_invert(nanobind::module_& module);

}  // namespace itn::python
