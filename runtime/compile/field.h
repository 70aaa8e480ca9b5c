// Volumes as the records and voxels of kernels/lib/field.h.
#pragma once
#include "runtime/compile/launch_data.h"

namespace itn {

// Returns its index among the data's fields.
int append_field(const Volume& volume, LaunchData& data);

}  // namespace itn
