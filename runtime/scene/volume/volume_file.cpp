#include "runtime/scene/volume/volume_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string_view>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/scene/volume/packed_voxels.h"

namespace itn {
namespace {

constexpr std::size_t header_bytes = 48;
constexpr std::uint64_t most_values = std::uint64_t{1} << 29;  // 2 GiB: what the device's indices and memory are for
constexpr std::uint64_t most_packed_values = std::uint64_t{1} << 36;  // of which few are stored

// All numbers of the format are little-endian, as those of every machine that this is built for.
template <class Number>
Number at(const std::array<char, header_bytes>& header, std::size_t byte) {
  Number number;
  std::memcpy(&number, header.data() + byte, sizeof(number));
  return number;
}

[[noreturn]] void fail(const std::string& file, const std::string& what) { throw InputError(file + ": " + what); }

std::string size_of(const VoxelGrid& grid) {
  return fmt::format("{} x {} x {} voxels", grid.width, grid.height, grid.depth);
}

}  // namespace

std::size_t checked_values(const VoxelGrid& grid, const std::string& file, bool packed) {
  const std::string size = size_of(grid);
  for (const int n : {grid.width, grid.height, grid.depth})
    if (n < 1 || n > most_voxels_along_axis)
      fail(file, fmt::format("{}; need 1 to {} along each axis", size, most_voxels_along_axis));
  if (grid.channels != 1 && grid.channels != 3)
    fail(file, fmt::format("{} channels; need 1 (numbers) or 3 (linear sRGB)", grid.channels));
  // The greatest product of two fits into 64 bits; that of three need not.
  const std::uint64_t layer = static_cast<std::uint64_t>(grid.width) * static_cast<std::uint64_t>(grid.height),
                      rows = static_cast<std::uint64_t>(grid.depth) * static_cast<std::uint64_t>(grid.channels);
  if (layer > (packed ? most_packed_values : most_values) / rows)
    fail(file, fmt::format("{} of {} channels; the most that is rendered is {} values{}: resample the grid", size,
                           grid.channels, packed ? most_packed_values : most_values,
                           packed ? "" : " (2 GiB), or more where \"bits\" is 8 or 16"));
  return layer * rows;
}

void check_values(const VoxelGrid& grid, const std::string& file, VoxelValues allowed) {
  const float least = allowed == VoxelValues::from_zero ? 0 : -greatest_voxel;
  if (grid.packed && grid.packed->least < least)
    fail(file, fmt::format("a voxel is {}; need numbers from {:g} to {:g}: mend the grid", grid.packed->least, least,
                           greatest_voxel));
  const auto width = static_cast<std::size_t>(grid.width), height = static_cast<std::size_t>(grid.height),
             channels = static_cast<std::size_t>(grid.channels);
  for (std::size_t i = 0; i < grid.data.size(); ++i) {
    const float value = grid.data[i];
    if (value >= least && value <= greatest_voxel) continue;
    const std::size_t voxel = i / channels;
    fail(file, fmt::format("voxel ({}, {}, {}) is {}; need numbers from {:g} to {:g}: mend the grid", voxel % width,
                           voxel / width % height, voxel / width / height, value, least, greatest_voxel));
  }
}

namespace {

// Reads the size and the box of the voxels from the beginning of a file.
VoxelGrid read_header(std::string_view bytes, const std::string& file, bool packed) {
  std::array<char, header_bytes> header{};
  std::copy_n(bytes.begin(), std::min(bytes.size(), header_bytes), header.begin());
  if (bytes.size() < 4 || std::memcmp(header.data(), "VOL", 3) != 0)
    fail(file, "does not begin with VOL; need a .vol file of version 3");
  if (header[3] != 3)
    fail(file, fmt::format(".vol file of version {}; need version 3", static_cast<unsigned char>(header[3])));
  if (bytes.size() < header_bytes)
    fail(file, fmt::format("ends within its header of {} bytes; copy the whole file", header_bytes));
  if (const auto encoding = at<std::int32_t>(header, 4); encoding != 1)
    fail(file, fmt::format("encoding {}; need 1: values of 32-bit floating point", encoding));
  VoxelGrid grid;
  grid.width = at<std::int32_t>(header, 8);
  grid.height = at<std::int32_t>(header, 12);
  grid.depth = at<std::int32_t>(header, 16);
  grid.channels = at<std::int32_t>(header, 20);
  checked_values(grid, file, packed);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    grid.low[axis] = static_cast<double>(at<float>(header, 24 + 4 * axis));
    grid.high[axis] = static_cast<double>(at<float>(header, 36 + 4 * axis));
  }
  return grid;
}

// Refuses a file by its header before all of it is read, which may be more than there is memory for.
void check_header(const std::string& file, bool packed) {
  check_regular_file(file);
  std::string beginning(header_bytes, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(beginning.data(), header_bytes);
  beginning.resize(static_cast<std::size_t>(in.gcount()));
  read_header(beginning, file, packed);
}

// values: as floats, x fastest, as they stand in the file
PackedVoxels packed_from(const VoxelGrid& grid, int bits, const std::string& file, const char* values) {
  const auto width = static_cast<std::size_t>(grid.width), height = static_cast<std::size_t>(grid.height),
             channels = static_cast<std::size_t>(grid.channels);
  return pack(grid, bits, file, [&](const std::array<int, 3>& brick, float* to) {
    const int right = std::min(brick_side, grid.width - brick_side * brick[0]);
    for (int z = brick_side * brick[2]; z < std::min(grid.depth, brick_side * (brick[2] + 1)); ++z)
      for (int y = brick_side * brick[1]; y < std::min(grid.height, brick_side * (brick[1] + 1)); ++y) {
        const std::size_t row = static_cast<std::size_t>(z) * height + static_cast<std::size_t>(y),
                          first = row * width + static_cast<std::size_t>(brick_side * brick[0]),
                          in_brick =
                              static_cast<std::size_t>((z % brick_side * brick_side + y % brick_side) * brick_side);
        std::memcpy(to + in_brick * channels, values + sizeof(float) * first * channels,
                    sizeof(float) * static_cast<std::size_t>(right) * channels);
      }
    return false;
  });
}

}  // namespace

VoxelGrid read_volume_file(const std::string& file, VoxelValues allowed, int bits) {
  check_header(file, bits != 0);
  VoxelGrid grid;
  {
    const std::string bytes = read_file(file);
    grid = read_header(bytes, file, bits != 0);
    const std::uint64_t values = checked_values(grid, file, bits != 0), needed = header_bytes + sizeof(float) * values;
    if (bytes.size() < needed)
      fail(file, fmt::format("{} bytes; {} of {} channels take {}: copy the whole file", bytes.size(), size_of(grid),
                             grid.channels, needed));
    if (bits != 0) {
      grid.packed = std::make_shared<const PackedVoxels>(packed_from(grid, bits, file, bytes.data() + header_bytes));
    } else {
      grid.data.resize(values);
      std::memcpy(grid.data.data(), bytes.data() + header_bytes, sizeof(float) * values);
    }
  }
  check_values(grid, file, allowed);
  return grid;
}

void write_volume_file(const std::string& file, const VoxelGrid& grid) {
  std::string bytes("VOL\3", 4);
  const auto put = [&](const auto& number) {
    const auto* const from = reinterpret_cast<const char*>(&number);
    bytes.append(from, sizeof(number));
  };
  for (const int n : {1, grid.width, grid.height, grid.depth, grid.channels}) put(static_cast<std::int32_t>(n));
  for (const Vec3& corner : {grid.low, grid.high})
    for (std::size_t axis = 0; axis < 3; ++axis) put(static_cast<float>(corner[axis]));
  for (const float value : grid.data) put(value);
  write_file(file, bytes);
}

}  // namespace itn
