// Shapes and image files as arrays.
#pragma once
#include <nanobind/nanobind.h>

namespace itn::python {

void bind_files(nanobind::module_& module);

}  // namespace itn::python
