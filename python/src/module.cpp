// itn._itn: what of the libraries Python needs. The package's Python files give it its shape.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "itn/error.h"
#include "python/src/device.h"
#include "python/src/files.h"
#include "python/src/gradient.h"
#include "python/src/invert.h"
#include "python/src/learn.h"
#include "python/src/render.h"
#include "python/src/scene.h"
#include "python/src/target.h"

namespace {

namespace nb = nanobind;

// One exception a kind of failure, with the text that the commands print.
void bind_errors(nb::module_& module) {
  const nb::object base = nb::steal(PyErr_NewExceptionWithDoc(
      "itn.Error", "What itn refuses or cannot do; the message says where, why, and what to do.", nullptr, nullptr));
  module.attr("Error") = base;
  nb::exception<itn::InputError>(module, "InputError", base.ptr()).attr("__doc__") =
      "A file is wrong: the message says where, what was expected and what to do.";
  nb::exception<itn::UsageError>(module, "UsageError", base.ptr()).attr("__doc__") =
      "An argument is wrong or does not go with another one.";
  const nb::object device = nb::exception<itn::DeviceError>(module, "DeviceError", base.ptr());
  device.attr("__doc__") = "OpenCL or its device fails, or there is none.";
  nb::exception<itn::ResultError>(module, "ResultError", base.ptr()).attr("__doc__") =
      "Something fails after good input: a folder that takes no files, numbers that are not finite.";
  for (const char* name : {"Error", "InputError", "UsageError", "DeviceError", "ResultError"})
    module.attr(name).attr("__module__") = "itn";
  const nb::object warning = nb::steal(PyErr_NewExceptionWithDoc(
      "itn.Warning", "What the commands warn of on standard error: a result that may not be what it seems.",
      PyExc_UserWarning, nullptr));
  module.attr("Warning") = warning;
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const itn::Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    }
  });
  nb::register_exception_translator(
      [](const std::exception_ptr& thrown, void* type) {
        try {
          std::rethrow_exception(thrown);
        } catch (const cl::Error& error) {
          PyErr_SetString(static_cast<PyObject*>(type),
                          (std::string(error.what()) + ": OpenCL error " + std::to_string(error.err())).c_str());
        }
      },
      device.ptr());
}

}  // namespace

NB_MODULE(_itn, module) {
  nb::set_leak_warnings(false);  // a scene in a notebook's global variable is none
  bind_errors(module);
  itn::python::bind_device(module);
  itn::python::bind_scene(module);
  itn::python::bind_render(module);
  itn::python::bind_target(module);
  itn::python::bind_gradient(module);
  itn::python::bind_invert(module);
  itn::python::bind_learn(module);
  itn::python::bind_files(module);
}
