// Grids of voxels in Mitsuba's .vol format, version 3.
#pragma once
#include <string>

#include "itn/scene.h"

namespace itn {

enum class VoxelValues { from_zero, of_any_sign };

// bits: 8, 16 or 32: the grid is packed; else 0. Throws InputError: unreadable, cut, of another version or encoding,
// not 1 or 3 channels, too large, or a value that is not finite or, where that is asked for, negative (says where).
VoxelGrid read_volume_file(const std::string& file, VoxelValues values = VoxelValues::from_zero, int bits = 0);

// In place of what the file held, whole or not at all. Throws ResultError: not writable.
void write_volume_file(const std::string& file, const VoxelGrid& grid);

// Number of values of a grid with this size and these channels. Throws InputError: none, or, where it is not packed,
// more than are rendered.
std::size_t checked_values(const VoxelGrid& grid, const std::string& file, bool packed = false);

// Throws InputError: a value is not finite, too large or, where that is asked for, negative (says where, of packed
// grids what).
void check_values(const VoxelGrid& grid, const std::string& file, VoxelValues allowed);

}  // namespace itn
