// Grids of voxels in Mitsuba's .vol format, version 3.
#pragma once
#include <string>

#include "runtime/scene/scene.h"

namespace itn {

// Throws InputError: unreadable, cut, of another version or encoding, not 1 or 3 channels, too large, or a value that
// is not finite or negative (says where).
VoxelGrid read_volume_file(const std::string& file);

}  // namespace itn
