#include "tools/itn/version_text.h"

#include <fmt/format.h>

#include <exception>

#include "itn/device.h"
#include "itn/version.h"

namespace itn::tools {
namespace {

std::string devices_text() {
  std::string text;
  try {
    for (const DeviceInfo& d : list_devices())
      text += fmt::format("{}{} {} ({} {}){}", text.empty() ? "" : "; ", d.index, d.name, d.platform, d.driver,
                          d.unusable.empty() ? "" : ", not usable: " + d.unusable);
  } catch (const std::exception& error) {  // the version is asked for where something is wrong
    return std::string("none; ") + error.what();
  }
  return text.empty() ? "none; install pocl-opencl-icd for the CPU, or a GPU's driver" : text;
}

}  // namespace

std::string version_text() {
  return fmt::format("itn {}\ndevices: {}\nbuilt with {}", version(), devices_text(), ITN_LIBRARIES);
}

}  // namespace itn::tools
