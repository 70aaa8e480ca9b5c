// Images with derivatives.
#pragma once
#include <nanobind/nanobind.h>

namespace itn::python {

void bind_render(nanobind::module_& module);

}  // namespace itn::python
