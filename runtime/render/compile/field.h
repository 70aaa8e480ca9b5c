// Volumes as the records and voxels of kernels/texture/field.h.
#pragma once
#include "runtime/render/compile/launch_data.h"

namespace itn {

// Returns its index among the data's fields. density: what the field is times where it is of an extinction [1 / scene
// unit]; else 0. Voxels so dense that a mean free path is below a rounding of places there are as dense as that.
int append_field(const Volume& volume, double density, LaunchData& data);

// Appends a volume that a texture samples, in the layout of kernels/model/texture/volume.h. Throws InputError: too many
// numbers.
void append_shown_volume(const Volume& volume, TextureRecord& r, LaunchData& data);

}  // namespace itn
