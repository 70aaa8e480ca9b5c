// Grids of voxels in OpenVDB files.
#pragma once
#include <string>

#include "itn/scene.h"
#include "runtime/scene/volume/volume_file.h"

namespace itn {

struct PlacedGrid {
  VoxelGrid grid;      // from the first to the last active voxel, and a layer of the background around, or more
  Transform to_world;  // of the unit cube, which the voxels fill, as the file says
};

// The grid of that name: numbers (float, double, half), or colours (vectors of three). bits: 8, 16 or 32: it is packed;
// 0: with 32, where it has more than 2^24 values and takes less than half of their memory then. Throws InputError:
// unreadable, cut, no such grid (says which there are), another class of grid, no linear transform, empty, too large,
// or a value that is not finite or, where that is asked for, negative (says where, of packed grids what).
PlacedGrid read_openvdb_file(const std::string& file, const std::string& name,
                             VoxelValues allowed = VoxelValues::from_zero, int bits = 0);

}  // namespace itn
