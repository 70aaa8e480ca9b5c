// The device that all calls share: one context, one cache of programs.
#pragma once
#include <nanobind/nanobind.h>

#include <memory>
#include <mutex>
#include <string>

#include "itn/device.h"

namespace itn::python {

// Renderers of one device run one after the other: each keeps all of it busy.
struct SharedDevice {
  explicit SharedDevice(const std::string& spec) : device(spec) {}
  Device device;
  std::mutex mutex;
};

// As set_device() chose it, else as commands do without --device.
std::shared_ptr<SharedDevice> shared_device();
// The same as it was asked for, for jobs that open a device of their own.
std::string shared_device_spec();

void bind_device(nanobind::module_& module);

}  // namespace itn::python
