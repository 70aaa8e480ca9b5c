#include "runtime/render/device/driver_faults.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "runtime/base/limits.h"

namespace itn {
namespace {

// ": LIBRARY: why" of each driver that the loader knows and that cannot be loaded; empty: none.
std::string driver_faults() {
  const char* own = std::getenv("OCL_ICD_VENDORS");  // a folder, a file or a library
  const std::filesystem::path folder = own && *own ? own : "/etc/OpenCL/vendors";
  std::string text;
  std::error_code error;
  for (std::filesystem::directory_iterator i(folder, error), end; !error && i != end; i.increment(error)) {
    if (i->path().extension() != ".icd") continue;
    std::string library;
    std::getline(std::ifstream(i->path()) >> std::ws, library);
    if (library.empty()) continue;
    if (void* loaded = dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL)) {
      dlclose(loaded);
      continue;
    }
    const char* why = dlerror();
    text += (text.empty() ? ": " : "; ") + std::string(why ? why : library);
  }
  return text;
}

}  // namespace

std::string no_device_reason() {
  const std::string faults = driver_faults(), limits = limits_in_force();
  if (!faults.empty()) return "no OpenCL device: the drivers that are installed cannot be loaded" + faults + limits;
  return (limits.empty() ? "no OpenCL device: no installed driver offers one"
                         : "no OpenCL device: no driver offers one" + limits) +
         "; install one, for instance Debian's pocl-opencl-icd (any CPU) or, beside the Python package, pip's "
         "pocl-binary-distribution with gcc, and check with 'itn devices'";
}

}  // namespace itn
