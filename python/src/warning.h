// Warnings of the libraries, as Python's warnings.
#pragma once
#include <nanobind/nanobind.h>

#include <string>

namespace itn::python {

// With the interpreter's lock. stacklevel: 1 is the line of Python that calls into this module. Throws where the user
// makes warnings errors.
inline void warn(const std::string& text, int stacklevel) {
  const nanobind::object category = nanobind::module_::import_("itn._itn").attr("Warning");
  if (PyErr_WarnEx(category.ptr(), text.c_str(), stacklevel) != 0) throw nanobind::python_error();
}

}  // namespace itn::python
