// Volumes as the records and voxels of kernels/lib/field.h.
#pragma once
#include "runtime/compile/launch_data.h"

namespace itn {

// Returns its index among the data's fields.
int append_field(const Volume& volume, LaunchData& data);

// What a texture shows, as kernels/model/texture/volume.h has it. Throws InputError: too many numbers.
void append_shown_volume(const Volume& volume, TextureRecord& r, LaunchData& data);

}  // namespace itn
