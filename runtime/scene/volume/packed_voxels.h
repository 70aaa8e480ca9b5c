// Grids of voxels in less memory than a float for each: bricks of 8 x 8 x 8 voxels, of which those with one and the
// same value everywhere are stored once, and numbers of 8 or 16 bits in place of floats. kernels/texture/field.h reads
// them as they are.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "itn/scene.h"
#include "kernels/shared/scene_layout.h"

namespace itn {

inline constexpr float greatest_voxel = 1e30F;
inline constexpr int most_voxels_along_axis = 1 << 20;
inline constexpr int brick_side = BRICK;

// Encoding of values by integers, and statistics of the values.
struct PackedRange {
  int bits = 32;            // 8 or 16: a value is low + step * number; 32: a float
  float low = 0, step = 0;  // of numbers
  float least = 0, greatest = 0;
  double mean = 0;  // of the values as they are stored
};

struct PackedVoxels : PackedRange {
  std::vector<std::int32_t> bricks;  // which of the stored ones each brick is, x fastest
  std::vector<std::uint32_t> words;  // stored bricks, one after another: x fastest, channels interleaved

  std::size_t bytes() const { return sizeof(std::uint32_t) * (bricks.size() + words.size()); }
  // value: voxel * channels + channel, the voxel counted in stored bricks
  float value(std::size_t value) const;
  // Index of the voxel at x, y, z of a grid with this many bricks along x and y.
  std::size_t voxel(const std::array<int, 2>& bricks_along, int x, int y, int z) const;
};

inline int bricks_along(int voxels) { return (voxels + brick_side - 1) / brick_side; }

// The values of a brick, x fastest, channels interleaved; beyond the grid anything. brick: its place among bricks.
// True: all voxels are as the first one, whose values alone are written.
using BrickValues = std::function<bool(const std::array<int, 3>& brick, float* values)>;

// grid: its size and channels. Reads every brick twice. Throws InputError: a value is not finite or too large (says
// where), or more than 2 GiB.
PackedVoxels pack(const VoxelGrid& grid, int bits, const std::string& file, const BrickValues& values);

// Range of all values of a grid, packed or not.
struct VoxelRange {
  float least, greatest;
};
VoxelRange range_of(const VoxelGrid& grid);
double mean_of(const VoxelGrid& grid);

}  // namespace itn
