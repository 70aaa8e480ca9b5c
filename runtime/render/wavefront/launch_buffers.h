// The arguments that all kernels of the wavefront take (kernels/shared/launch_arguments.h), as buffers.
#pragma once
#include "itn/device.h"
#include "kernels/shared/launch_arguments.h"
#include "runtime/render/compile/launch_data.h"

namespace itn {

struct LaunchBuffers {
#define ITN_BUFFER(type, name) cl::Buffer name;
  LAUNCH_ARGUMENTS(ITN_BUFFER)
#undef ITN_BUFFER

  // Uploads all geometries; frees the memory of earlier ones first.
  void upload_geometry(const Device& device, const Geometry& geometry);
  // Everything else that scenes are made of.
  void upload_scenes(const Device& device, const LaunchData& data);

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
