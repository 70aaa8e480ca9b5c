#include "runtime/scene/openvdb_file.h"

#include <fmt/core.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>

#include "runtime/base/child_process.h"
#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/base/inputs.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/volume_file.h"

namespace itn {
namespace {

[[noreturn]] void fail(const std::string& file, const std::string& what) { throw InputError(file + ": " + what); }

// OpenVDB transforms row vectors: the transpose of ours.
Transform affine(const openvdb::math::Transform& transform) {
  const openvdb::math::Mat4d m = transform.baseMap()->getAffineMap()->getMat4();
  Transform result;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) result.m[static_cast<std::size_t>(4 * row + column)] = m(column, row);
  return result;
}

Vec3 vector(const openvdb::Coord& c) {
  return {static_cast<double>(c.x()), static_cast<double>(c.y()), static_cast<double>(c.z())};
}

// The values in `box`, x fastest.
template <class Grid>
void fill(const Grid& from, const openvdb::CoordBBox& box, VoxelGrid& grid) {
  using Value = typename Grid::ValueType;
  openvdb::tools::Dense<Value, openvdb::tools::LayoutXYZ> dense(box);
  openvdb::tools::copyToDense(from, dense, /*serial*/ true);
  const Value* values = dense.data();
  for (std::size_t i = 0; i < grid.data.size(); ++i) {
    if constexpr (openvdb::VecTraits<Value>::IsVec)
      grid.data[i] = static_cast<float>(values[i / 3][static_cast<int>(i % 3)]);
    else
      grid.data[i] = static_cast<float>(values[i]);
  }
}

// Calls f with the grid as what it is. False: no grid of numbers or colours.
template <class F>
bool with_type(const openvdb::GridBase& grid, const F& f) {
  if (grid.isType<openvdb::FloatGrid>()) return f(static_cast<const openvdb::FloatGrid&>(grid)), true;
  if (grid.isType<openvdb::DoubleGrid>()) return f(static_cast<const openvdb::DoubleGrid&>(grid)), true;
  if (grid.isType<openvdb::Vec3SGrid>()) return f(static_cast<const openvdb::Vec3SGrid&>(grid)), true;
  return false;
}

openvdb::GridBase::Ptr read_grid(const std::string& file, const std::string& name) {
  openvdb::io::File in(file);
  in.open(false);  // not read later, when the file may have changed
  std::string names;
  for (auto i = in.beginName(); i != in.endName(); ++i) names += (names.empty() ? "" : ", ") + i.gridName();
  if (!in.hasGrid(name))
    throw InputError(
        fmt::format("has no grid \"{}\"; need one of these: {}", name, names.empty() ? "(there is none)" : names));
  return in.readGrid(name);
}

PlacedGrid place(const std::string& name, const openvdb::GridBase& source) {
  const std::string grid_name = fmt::format("grid \"{}\"", name);
  if (source.getGridClass() == openvdb::GRID_LEVEL_SET)
    throw InputError(grid_name + " is a level set, distances to a surface; need a fog volume: convert it");
  if (!source.transform().isLinear())
    throw InputError(
        grid_name +
        " has a transform that is not linear (a frustum); need one of voxels of the same shape: resample it");
  openvdb::CoordBBox box = source.evalActiveVoxelBoundingBox();
  if (box.empty()) throw InputError(grid_name + " has no active voxels; need some: export a grid with content");
  PlacedGrid placed;
  VoxelGrid& grid = placed.grid;
  const bool is_colour = source.isType<openvdb::Vec3SGrid>();
  const auto extent = [&](std::size_t axis) {  // in 64 bits: a broken file's coordinates may be anything
    const auto n = std::int64_t{box.max()[axis]} - box.min()[axis] + 3;
    return static_cast<int>(std::min<std::int64_t>(n, std::numeric_limits<int>::max()));
  };
  grid.width = extent(0);
  grid.height = extent(1);
  grid.depth = extent(2);
  grid.channels = is_colour ? 3 : 1;
  grid.data.resize(checked_values(grid, grid_name));
  box.expand(1);
  if (!with_type(source, [&](const auto& typed) { fill(typed, box, grid); }))
    throw InputError(
        fmt::format("{} holds values of type {}; need float, double or vec3s", grid_name, source.valueType()));
  // whole coordinates are the middles of voxels
  placed.to_world =
      affine(source.transform()) * translate(vector(box.min()) - Vec3{0.5, 0.5, 0.5}) * scale(vector(box.dim()));
  return placed;
}

// How a grid comes back from the process that has read it.
struct Header {
  std::array<int, 4> size;
  Transform to_world;
};

std::string bytes_of(const PlacedGrid& placed) {
  const VoxelGrid& grid = placed.grid;
  const Header header{{grid.width, grid.height, grid.depth, grid.channels}, placed.to_world};
  std::string bytes(reinterpret_cast<const char*>(&header), sizeof(header));
  return bytes.append(reinterpret_cast<const char*>(grid.data.data()), grid.data.size() * sizeof(float));
}

PlacedGrid from_bytes(const std::string& bytes) {
  Header header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  PlacedGrid placed;
  placed.to_world = header.to_world;
  placed.grid.width = header.size[0];
  placed.grid.height = header.size[1];
  placed.grid.depth = header.size[2];
  placed.grid.channels = header.size[3];
  placed.grid.data.resize((bytes.size() - sizeof(header)) / sizeof(float));
  std::memcpy(placed.grid.data.data(), bytes.data() + sizeof(header), bytes.size() - sizeof(header));
  return placed;
}

// A broken file's names may be anything.
std::string printable(std::string text) {
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  return text;
}

}  // namespace

PlacedGrid read_openvdb_file(const std::string& file, const std::string& name, VoxelValues allowed) {
  check_regular_file(file);
  const ForeignInput input(file);
  std::string bytes;
  try {
    bytes = in_child_process([&] {
      openvdb::initialize();
      try {
        return bytes_of(place(name, *read_grid(file, name)));
      } catch (const openvdb::Exception& error) {
        throw InputError(std::string(error.what()) + "; need a whole OpenVDB file");
      }
    });
  } catch (const InputError& error) {
    fail(file, printable(error.what()));
  }
  input.note();
  PlacedGrid placed = from_bytes(bytes);
  check_values(placed.grid, file, allowed);
  return placed;
}

}  // namespace itn
