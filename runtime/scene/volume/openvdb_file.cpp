#include "runtime/scene/volume/openvdb_file.h"

#include <fmt/core.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/File.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <type_traits>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/child_process.h"
#include "runtime/base/inputs.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/volume/packed_voxels.h"
#include "runtime/scene/volume/volume_file.h"

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

// Checks values, and calls voxels what the file calls them.
class ValueCheck {
 public:
  ValueCheck(const std::string& name, VoxelValues allowed)
      : name_(name), least_(allowed == VoxelValues::from_zero ? 0 : -greatest_voxel) {}
  void require(float value, const openvdb::Coord& at) const {
    if (!(value >= least_ && value <= greatest_voxel))
      throw InputError(fmt::format("{}: voxel ({}, {}, {}) is {}; need numbers from {:g} to {:g}: mend the grid", name_,
                                   at.x(), at.y(), at.z(), value, least_, greatest_voxel));
  }
  // As they lie in `box`, x fastest, channels interleaved.
  void require(const float* values, const openvdb::CoordBBox& box, int channels) const {
    for (int z = box.min().z(); z <= box.max().z(); ++z)
      for (int y = box.min().y(); y <= box.max().y(); ++y)
        for (int x = box.min().x(); x <= box.max().x(); ++x)
          for (int c = 0; c < channels; ++c) require(*values++, {x, y, z});
  }

 private:
  const std::string& name_;
  float least_;
};

// The values in `box`, x fastest, channels interleaved.
template <class Grid>
void fill(const Grid& from, const openvdb::CoordBBox& box, float* values) {
  using Value = typename Grid::ValueType;
  using Dense = openvdb::tools::Dense<Value, openvdb::tools::LayoutXYZ>;
  if constexpr (std::is_same_v<Value, float>) {
    Dense dense(box, values);
    openvdb::tools::copyToDense(from, dense, /*serial*/ true);
    return;
  }
  Dense dense(box);
  openvdb::tools::copyToDense(from, dense, /*serial*/ true);
  for (std::size_t i = 0; i < dense.valueCount(); ++i) {
    const Value& value = dense.data()[i];
    if constexpr (openvdb::VecTraits<Value>::IsVec)
      for (int c = 0; c < 3; ++c) *values++ = static_cast<float>(value[c]);
    else
      *values++ = static_cast<float>(value);
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

// The library takes what is in its memory for what is behind a file's end, but for parts that are compressed.
class WholeFile : public openvdb::io::Archive {
 public:
  // End of the file's last grid. Throws std::ios_base::failure: the file ends before that.
  std::int64_t end_of_grids(std::istream& in) {
    readHeader(in);
    std::int64_t end = 0;
    if (!inputHasGridOffsets()) return end;
    setFormatVersion(in);  // what is read next depends on it
    setLibraryVersion(in);
    openvdb::MetaMap().readMeta(in);
    for (std::int32_t left = readGridCount(in); left > 0; --left) {
      openvdb::io::GridDescriptor grid;
      grid.read(in);
      end = std::max(end, grid.getEndPos());
      grid.seekToEnd(in);
    }
    return end;
  }
  bool has_places() const { return inputHasGridOffsets(); }
};

void require_whole(const std::string& file) {
  constexpr const char* cut = "ends before its grids do: copy the whole file";
  std::ifstream in(file, std::ios::binary);
  in.exceptions(std::ios::failbit | std::ios::badbit);
  try {
    WholeFile whole;
    const std::int64_t end = whole.end_of_grids(in);
    if (whole.has_places() && end > static_cast<std::int64_t>(in.seekg(0, std::ios::end).tellg()))
      throw InputError(cut);
    if (whole.has_places()) return;
    in.seekg(0);
    openvdb::io::Stream all(in, /*delayed*/ false);  // of grids one after another: by reading them
  } catch (const std::ios_base::failure&) {
    throw InputError(cut);
  }
}

openvdb::GridBase::Ptr read_grid(const std::string& file, const std::string& name) {
  require_whole(file);
  openvdb::io::File in(file);
  in.open(false);  // not read later, when the file may have changed
  std::string names;
  for (auto i = in.beginName(); i != in.endName(); ++i) names += (names.empty() ? "" : ", ") + i.gridName();
  if (!in.hasGrid(name))
    throw InputError(
        fmt::format("has no grid \"{}\"; need one of these: {}", name, names.empty() ? "(there is none)" : names));
  return in.readGrid(name);
}

// Bricks of our own are leaves of the file's tree where the grid begins at a multiple of their size.
template <class Grid>
PackedVoxels packed_from(const Grid& from, const openvdb::Coord& first, const VoxelGrid& size, int bits,
                         const std::string& name, const ValueCheck& check) {
  using Value = typename Grid::ValueType;
  using Leaf = typename Grid::TreeType::LeafNodeType;
  static_assert(Leaf::DIM == brick_side);
  const auto accessor = from.getConstAccessor();
  const openvdb::Coord end = first.offsetBy(size.width, size.height, size.depth);
  const auto put = [&](const Value& value, const openvdb::Coord& at, float*& to) {
    const bool inside = at.x() < end.x() && at.y() < end.y() && at.z() < end.z();
    const auto one = [&](auto number) {
      if (inside) check.require(static_cast<float>(number), at);
      *to++ = static_cast<float>(number);
    };
    if constexpr (openvdb::VecTraits<Value>::IsVec)
      for (int c = 0; c < 3; ++c) one(value[c]);
    else
      one(value);
  };
  return pack(size, bits, name, [&](const std::array<int, 3>& brick, float* to) {
    const openvdb::Coord corner = first.offsetBy(brick_side * brick[0], brick_side * brick[1], brick_side * brick[2]);
    const Leaf* leaf = accessor.probeConstLeaf(corner);
    if (!leaf) {
      put(accessor.getValue(corner), corner, to);
      return true;
    }
    for (int z = 0; z < brick_side; ++z)
      for (int y = 0; y < brick_side; ++y)
        for (int x = 0; x < brick_side; ++x)
          put(leaf->getValue(Leaf::coordToOffset({x, y, z})), corner.offsetBy(x, y, z), to);
    return false;
  });
}

// The header by which the reading process sends a grid back; its values follow, or the bricks and words of packed ones.
struct Header {
  std::array<int, 4> size;  // width, height, depth, channels
  Transform to_world;
  std::size_t bricks = 0;  // 0: not packed
  PackedRange packed = {};
};

std::string bytes_of(const Header& header, std::size_t values) {
  std::string bytes(sizeof(header) + values * sizeof(float), '\0');  // of a large grid there is room for one copy
  std::memcpy(bytes.data(), &header, sizeof(header));
  return bytes;
}

std::string bytes_of(Header header, const PackedVoxels& packed) {
  header.packed = packed;
  header.bricks = packed.bricks.size();
  std::string bytes = bytes_of(header, header.bricks + packed.words.size());
  std::memcpy(bytes.data() + sizeof(header), packed.bricks.data(), sizeof(float) * header.bricks);
  std::memcpy(bytes.data() + sizeof(header) + sizeof(float) * header.bricks, packed.words.data(),
              sizeof(float) * packed.words.size());
  return bytes;
}

constexpr std::size_t most_dense_values = std::size_t{1} << 24;  // 64 MiB: above, what packing saves is asked for

// The size of a grid that fills a box; in 64 bits, since a broken file's coordinates may be anything.
VoxelGrid size_of(const openvdb::CoordBBox& box, int channels) {
  const auto along = [&](int axis) {
    const std::int64_t n = std::int64_t{box.max()[axis]} - box.min()[axis] + 1;
    return static_cast<int>(std::clamp<std::int64_t>(n, 0, std::numeric_limits<int>::max()));
  };
  VoxelGrid size;
  size.width = along(0);
  size.height = along(1);
  size.depth = along(2);
  size.channels = channels;
  return size;
}

Header header_of(const openvdb::GridBase& source, const openvdb::CoordBBox& box, const VoxelGrid& size) {
  // whole coordinates are the middles of voxels
  return {{size.width, size.height, size.depth, size.channels},
          affine(source.transform()) * translate(vector(box.min()) - Vec3{0.5, 0.5, 0.5}) * scale(vector(box.dim()))};
}

// All bricks of a grid's box are looked at: nobody means a box whose voxels are next to nowhere.
template <class Grid>
void check_worth(const Grid& source, const VoxelGrid& size, const std::string& name) {
  constexpr std::size_t many_bricks = std::size_t{1} << 22, bricks_a_leaf = 1024;
  std::size_t bricks = 1;
  for (const int n : {size.width, size.height, size.depth}) bricks *= static_cast<std::size_t>(bricks_along(n));
  const std::size_t leaves = source.tree().leafCount();
  if (bricks > many_bricks && bricks / bricks_a_leaf > leaves)
    throw InputError(fmt::format(
        "{}: {} active voxels lie in a box of {} x {} x {}, of whose {} bricks of 8 x 8 x 8 only {} have any; "
        "need one in {}: take far voxels out of the grid, or cut it into several",
        name, source.activeVoxelCount(), size.width, size.height, size.depth, bricks, leaves, bricks_a_leaf));
}

template <class Grid>
std::string bytes_of(const Grid& source, const openvdb::CoordBBox& box, int channels, int bits, const std::string& name,
                     const ValueCheck& check) {
  const VoxelGrid size = size_of(box, channels);
  if (const std::size_t values = checked_values(size, name, /*packed=*/true); bits != 0 || values > most_dense_values) {
    openvdb::CoordBBox leaves = box;
    leaves.min() = leaves.min() & ~(brick_side - 1);
    const VoxelGrid whole = size_of(leaves, channels);
    check_worth(source, whole, name);
    const PackedVoxels packed = packed_from(source, leaves.min(), whole, bits == 0 ? 32 : bits, name, check);
    if (bits != 0 || packed.bytes() < values * sizeof(float) / 2)
      return bytes_of(header_of(source, leaves, whole), packed);
  }
  std::string bytes = bytes_of(header_of(source, box, size), checked_values(size, name));
  auto* values = reinterpret_cast<float*>(bytes.data() + sizeof(Header));
  fill(source, box, values);
  check.require(values, box, channels);
  return bytes;
}

std::string bytes_of(const std::string& name, const openvdb::GridBase& source, VoxelValues allowed, int bits) {
  const std::string grid_name = fmt::format("grid \"{}\"", name);
  if (source.getGridClass() == openvdb::GRID_LEVEL_SET)
    throw InputError(grid_name + " is a level set, distances to a surface; need a fog volume: convert it");
  if (!source.transform().isLinear())
    throw InputError(
        grid_name +
        " has a transform that is not linear (a frustum); need one of voxels of the same shape: resample it");
  openvdb::CoordBBox box = source.evalActiveVoxelBoundingBox();
  if (box.empty()) throw InputError(grid_name + " has no active voxels; need some: export a grid with content");
  const int channels = source.isType<openvdb::Vec3SGrid>() ? 3 : 1;
  checked_values(size_of(box, channels), grid_name, /*packed=*/true);
  box.expand(1);
  const ValueCheck check(grid_name, allowed);
  std::string bytes;
  if (!with_type(source, [&](const auto& typed) { bytes = bytes_of(typed, box, channels, bits, grid_name, check); }))
    throw InputError(
        fmt::format("{} holds values of type {}; need float, double or vec3s", grid_name, source.valueType()));
  return bytes;
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
  const char* values = bytes.data() + sizeof(header);
  const std::size_t count = (bytes.size() - sizeof(header)) / sizeof(float);
  if (header.bricks == 0) {
    placed.grid.data.resize(count);
    std::memcpy(placed.grid.data.data(), values, sizeof(float) * count);
    return placed;
  }
  PackedVoxels packed{header.packed, {}, {}};
  packed.bricks.resize(header.bricks);
  packed.words.resize(count - header.bricks);
  std::memcpy(packed.bricks.data(), values, sizeof(float) * header.bricks);
  std::memcpy(packed.words.data(), values + sizeof(float) * header.bricks, sizeof(float) * packed.words.size());
  placed.grid.packed = std::make_shared<const PackedVoxels>(std::move(packed));
  return placed;
}

}  // namespace

PlacedGrid read_openvdb_file(const std::string& file, const std::string& name, VoxelValues allowed, int bits) {
  check_regular_file(file);
  const ForeignInput input(file);
  std::string bytes;
  try {
    bytes = in_child_process([&] {
      openvdb::initialize();
      try {
        return bytes_of(name, *read_grid(file, name), allowed, bits);
      } catch (const openvdb::Exception& error) {
        throw InputError(std::string(error.what()) + "; need a whole OpenVDB file");
      }
    });
  } catch (const InputError& error) {
    fail(file, error.what());
  }
  input.note();
  PlacedGrid placed = from_bytes(bytes);
  bytes = std::string();
  check_values(placed.grid, file, allowed);
  return placed;
}

}  // namespace itn
