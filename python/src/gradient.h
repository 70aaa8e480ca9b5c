// Image losses with their gradients, weighed derivatives, and the check of derivatives.
#pragma once
#include <nanobind/nanobind.h>

namespace itn::python {

void bind_gradient(nanobind::module_& module);

}  // namespace itn::python
