#include "python/src/device.h"

#include <nanobind/stl/string.h>

#include "itn/version.h"

namespace itn::python {
namespace {

namespace nb = nanobind;

std::mutex choice_mutex;
std::shared_ptr<SharedDevice> chosen;
std::string chosen_spec;

nb::dict describe(const DeviceInfo& info) {
  nb::dict result;
  result["index"] = info.index;
  result["platform"] = info.platform;
  result["name"] = info.name;
  result["type"] = info.type;
  result["driver"] = info.driver;
  result["version"] = info.version;
  result["memory"] = info.memory;
  result["compute_units"] = info.compute_units;
  result["unusable"] = info.unusable;
  return result;
}

}  // namespace

std::shared_ptr<SharedDevice> shared_device() {
  const std::lock_guard lock(choice_mutex);
  if (!chosen) chosen = std::make_shared<SharedDevice>("");
  return chosen;
}

std::string shared_device_spec() {
  const std::lock_guard lock(choice_mutex);
  return chosen_spec;
}

void bind_device(nb::module_& module) {
  module.def(
      "devices",
      [] {
        nb::list result;
        for (const DeviceInfo& info : list_devices()) result.append(describe(info));
        return result;
      },
      "Every OpenCL device, as `itn devices` lists them.");
  module.def(
      "device",
      [] {
        DeviceInfo info;
        {
          const nb::gil_scoped_release release;
          info = shared_device()->device.info();
        }
        return describe(info);
      },
      "The device that is in use.");
  module.def(
      "set_device",
      [](const std::string& spec) {
        const nb::gil_scoped_release release;
        auto device = std::make_shared<SharedDevice>(spec);
        const std::lock_guard lock(choice_mutex);
        chosen = std::move(device);
        chosen_spec = spec;
      },
      nb::arg("spec"),
      "Index, cpu, gpu or a part of a name, for all calls after this one. Default: the environment variable "
      "ITN_DEVICE, "
      "else the first GPU, else the first CPU.");
  module.attr("__version__") = version();
}

}  // namespace itn::python
