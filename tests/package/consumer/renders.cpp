// A user of the library: lists the devices and reads a kernel out of the library.
#include <runtime/render/device/device.h>
#include <runtime/render/device/kernel_source.h>

int main() {
  const bool has_kernels = itn::kernel_source("shared/portable.h").find("REAL") != std::string::npos;
  return itn::list_devices().empty() || !has_kernels ? 1 : 0;
}
