// The arguments that all kernels of the wavefront take (kernels/shared/launch_arguments.h), as buffers.
#pragma once
#include "kernels/shared/launch_arguments.h"
#include "runtime/device/device.h"

namespace itn {

struct LaunchBuffers {
#define ITN_BUFFER(type, name) cl::Buffer name;
  LAUNCH_ARGUMENTS(ITN_BUFFER)
#undef ITN_BUFFER

  // Sets the kernel's first arguments; returns the index of the next.
  cl_uint set_arguments(cl::Kernel& kernel) const {
    cl_uint at = 0;
#define ITN_SET_BUFFER(type, name) kernel.setArg(at++, name);
    LAUNCH_ARGUMENTS(ITN_SET_BUFFER)
#undef ITN_SET_BUFFER
    return at;
  }
};

}  // namespace itn
