#include "runtime/render/compile/field.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "itn/error.h"
#include "runtime/base/parallel.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/volume/packed_voxels.h"

namespace itn {
namespace {

// Coarse cells: 4 voxels along each axis, more where there would be more than 32 cells.
constexpr int voxels_a_cell = 4, most_cells = 32;
// Distance by which rounding may move a place between cells [voxel].
constexpr double margin = 1e-3;
// Null collisions along a segment through a cell, from which on cells are half voxels, if these are along the axes of
// the world and no more than so many: where the field is 0, between its voxels, so is then the greatest value.
constexpr double many_collisions = 1000;
constexpr std::size_t most_fine_cells = std::size_t{1} << 22;
// Mean free paths are no shorter than this part of the coordinates: positions move by roundings of these.
constexpr double shortest_path = 0x1p-18;

struct Affine {
  std::array<double, 9> linear{};
  Vec3 shift{};

  Vec3 operator()(const Vec3& p) const {
    Vec3 r = shift;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) r[i] += linear[3 * i + k] * p[k];
    return r;
  }
};

// From the world to voxels: voxel i reaches from i to i + 1.
Affine to_voxels(const Transform& to_world, const std::array<int, 3>& size) {
  const Transform normals = inverse_transpose(to_world);
  const Vec3 origin = transform_point(to_world, {0, 0, 0});
  Affine affine;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      affine.linear[3 * i + k] = normals.m[4 * k + i] * size[i];
      affine.shift[i] -= affine.linear[3 * i + k] * origin[k];
    }
  return affine;
}

int wrap_of(const Volume& volume) {
  return volume.wrap == Volume::Wrap::repeat   ? TEXTURE_REPEAT
         : volume.wrap == Volume::Wrap::mirror ? TEXTURE_MIRROR
                                               : TEXTURE_CLAMP;
}

int wrapped(int wrap, long i, int n) {
  if (wrap == TEXTURE_CLAMP) return static_cast<int>(std::clamp(i, 0L, static_cast<long>(n) - 1));
  const long period = wrap == TEXTURE_MIRROR ? 2L * n : n, m = (i % period + period) % period;
  return static_cast<int>(m < n ? m : period - 1 - m);
}

// The voxels along an axis that places from low to high are interpolated from, each once.
std::vector<int> voxels_between(double low, double high, int n, int wrap, bool nearest, double beside) {
  const double half = nearest ? 0 : 0.5;
  const long first = static_cast<long>(std::floor(low - half - beside)),
             last = static_cast<long>(std::floor(high - half + beside)) + (nearest ? 0 : 1);
  std::vector<bool> used(static_cast<std::size_t>(n));
  for (long i = first; i <= std::min(last, first + 2L * n); ++i)
    used[static_cast<std::size_t>(wrapped(wrap, i, n))] = true;
  used[static_cast<std::size_t>(wrapped(wrap, last, n))] = true;
  std::vector<int> result;
  for (int i = 0; i < n; ++i)
    if (used[static_cast<std::size_t>(i)]) result.push_back(i);
  return result;
}

// The box around a box in the world, in voxels.
std::pair<Vec3, Vec3> around(const Affine& map, const Vec3& low, const Vec3& high) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Vec3 least{infinity, infinity, infinity}, most{-infinity, -infinity, -infinity};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p = map({corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1], corner & 4 ? high[2] : low[2]});
    for (std::size_t a = 0; a < 3; ++a) {
      least[a] = std::min(least[a], p[a]);
      most[a] = std::max(most[a], p[a]);
    }
  }
  return {least, most};
}

// Greatest and least value, of all channels, that the field has in a box of the world.
std::pair<float, float> extremes(const VoxelGrid& grid, const FieldRecord& r, const Affine& map, const Vec3& low,
                                 const Vec3& high, double beside) {
  const auto [least, most] = around(map, low, high);
  std::array<std::vector<int>, 3> voxels;
  for (std::size_t a = 0; a < 3; ++a)
    voxels[a] = voxels_between(least[a], most[a], r.size[a], r.wrap, r.nearest != 0, beside);
  std::pair<float, float> result{0, std::numeric_limits<float>::infinity()};
  const auto channels = static_cast<std::size_t>(grid.channels);
  const PackedVoxels* packed = grid.packed.get();
  const std::array<int, 2> bricks{bricks_along(grid.width), bricks_along(grid.height)};
  for (const int z : voxels[2])
    for (const int y : voxels[1]) {
      const std::size_t row =
          (static_cast<std::size_t>(z) * static_cast<std::size_t>(grid.height) + static_cast<std::size_t>(y)) *
          static_cast<std::size_t>(grid.width);
      std::size_t voxel = 0;
      for (int before = -1; const int x : voxels[0]) {
        const bool next_in_brick = before == x - 1 && x % brick_side != 0;
        voxel = !packed         ? row + static_cast<std::size_t>(x)
                : next_in_brick ? voxel + 1
                                : packed->voxel(bricks, x, y, z);
        before = x;
        for (std::size_t i = voxel * channels; i < (voxel + 1) * channels; ++i) {
          const float value = packed ? packed->value(i) : grid.data[i];
          result.first = std::max(result.first, value);
          result.second = std::min(result.second, value);
        }
      }
    }
  return result;
}

// beside: how much of the voxels beside a cell counts [voxel]
void append_cells(const VoxelGrid& grid, const Affine& map, double beside, FieldRecord& r, LaunchData& data) {
  r.first_cell = static_cast<int>(data.voxels.size());
  const int rows = r.cells[1] * r.cells[2];
  data.voxels.resize(data.voxels.size() + 2 * static_cast<std::size_t>(rows) * static_cast<std::size_t>(r.cells[0]));
  float* cells = data.voxels.data() + r.first_cell;
  parallel_for(static_cast<std::size_t>(rows), [&](std::size_t row) {
    const std::array<int, 3> cell{0, static_cast<int>(row) % r.cells[1], static_cast<int>(row) / r.cells[1]};
    for (int x = 0; x < r.cells[0]; ++x) {
      Vec3 low{}, high{};
      for (std::size_t a = 0; a < 3; ++a) {
        const int index = a == 0 ? x : cell[a];
        const double from = static_cast<double>(r.low[a]), step = static_cast<double>(r.cell_size[a]);
        low[a] = from + step * index;
        high[a] = low[a] + step;
      }
      const auto [greatest, least] = extremes(grid, r, map, low, high, beside);
      float* out = cells + 2 * (row * static_cast<std::size_t>(r.cells[0]) + static_cast<std::size_t>(x));
      out[0] = greatest;
      out[1] = least;
    }
  });
}

// cells: for how many coarse ones there is to be room behind them; grown for those later, the voxels would be there
// twice for a while.
void append_voxels(const VoxelGrid& grid, std::size_t cells, LaunchData& data) {
  const std::size_t first = data.voxels.size();
  if (!grid.packed) {
    data.voxels.reserve(first + grid.data.size() + 2 * cells);
    data.voxels.insert(data.voxels.end(), grid.data.begin(), grid.data.end());
    return;
  }
  const PackedVoxels& packed = *grid.packed;  // integers as they are: the device's array has one type
  static_assert(sizeof(float) == sizeof(packed.bricks[0]) && sizeof(float) == sizeof(packed.words[0]));
  data.voxels.reserve(first + packed.bytes() / sizeof(float) + 2 * cells);
  data.voxels.resize(first + packed.bytes() / sizeof(float));
  std::memcpy(data.voxels.data() + first, packed.bricks.data(), sizeof(float) * packed.bricks.size());
  std::memcpy(data.voxels.data() + first + packed.bricks.size(), packed.words.data(),
              sizeof(float) * packed.words.size());
}

const VoxelGrid& one() {
  static const VoxelGrid grid = [] {
    VoxelGrid single;
    single.width = single.height = single.depth = 1;
    single.data = {1};
    return single;
  }();
  return grid;
}

// No value above `most`.
VoxelGrid limited(const VoxelGrid& grid, float most) {
  VoxelGrid result = grid;
  for (float& value : result.data) value = std::min(value, most);
  if (!grid.packed) return result;
  PackedVoxels packed = *grid.packed;
  if (packed.bits == 32) {
    for (std::uint32_t& word : packed.words)
      word = std::bit_cast<std::uint32_t>(std::min(std::bit_cast<float>(word), most));
  } else {  // of a few levels, between which there is no more to tell
    packed.low = std::min(packed.low, most);
    packed.step = std::min(packed.step, (most - packed.low) / static_cast<float>((1U << unsigned(packed.bits)) - 1));
  }
  packed.greatest = std::min(packed.greatest, most);
  packed.mean = std::min(packed.mean, static_cast<double>(most));
  result.packed = std::make_shared<const PackedVoxels>(std::move(packed));
  return result;
}

// The grid's axis along each of the world's; empty: they are rotated against each other.
std::optional<std::array<std::size_t, 3>> axes_of(const Affine& map) {
  std::array<std::size_t, 3> along{};
  for (std::size_t a = 0; a < 3; ++a) {
    std::size_t found = 0;
    for (std::size_t i = 0; i < 3; ++i)
      if (map.linear[3 * i + a] != 0) {
        along[a] = i;
        ++found;
      }
    if (found != 1) return std::nullopt;
  }
  return along;
}

}  // namespace

int append_field(const Volume& volume, double density, LaunchData& data) {
  const VoxelGrid& all = volume.grid ? *volume.grid : one();
  FieldRecord r{};
  double extent = 0;
  const std::array<int, 3> size{all.width, all.height, all.depth};
  const Affine map = to_voxels(volume.to_world, size);
  Vec3 low = transform_point(volume.to_world, {0, 0, 0}), high = low;
  for (int corner = 1; corner < 8; ++corner) {
    const Vec3 p =
        transform_point(volume.to_world, {corner & 1 ? 1.0 : 0.0, corner & 2 ? 1.0 : 0.0, corner & 4 ? 1.0 : 0.0});
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], p[a]);
      high[a] = std::max(high[a], p[a]);
    }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t k = 0; k < 3; ++k) r.to_voxels[4 * a + k] = static_cast<float>(map.linear[3 * a + k]);
    r.to_voxels[4 * a + 3] = static_cast<float>(map.shift[a]);
    r.low[a] = static_cast<float>(low[a]);
    r.high[a] = static_cast<float>(high[a]);
    r.size[a] = size[a];
    r.cells[a] = std::clamp((size[a] + voxels_a_cell - 1) / voxels_a_cell, 1, most_cells);
    r.cell_size[a] = (r.high[a] - r.low[a]) / static_cast<float>(r.cells[a]);
    extent = std::max({extent, std::abs(low[a]), std::abs(high[a])});
  }
  const double greatest = density > 0 ? static_cast<double>(range_of(all).greatest) : 0,
               densest = 1 / (shortest_path * extent);
  const bool too_dense = volume.grid && density * greatest > densest;
  const VoxelGrid dense = too_dense ? limited(all, static_cast<float>(densest / density)) : VoxelGrid{};
  const VoxelGrid& grid = too_dense ? dense : all;
  double beside = margin;
  if (const auto along = axes_of(map);
      along && density * greatest * *std::min_element(r.cell_size, r.cell_size + 3) > many_collisions &&
      8 * static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]) <=
          most_fine_cells) {
    for (std::size_t a = 0; a < 3; ++a) {
      r.cells[a] = 2 * size[(*along)[a]];
      r.cell_size[a] = (r.high[a] - r.low[a]) / static_cast<float>(r.cells[a]);
    }
    beside = -margin;
  }
  r.channels = grid.channels;
  r.wrap = wrap_of(volume);
  r.nearest = volume.nearest;
  r.gradient = r.sum = -1;
  r.mean = static_cast<float>(mean_of(grid));
  const auto next = static_cast<int>(data.voxels.size());
  const auto [known, first_of_grid] = data.voxels_of.try_emplace(&all, too_dense ? -1 : next);
  const bool is_new = first_of_grid || too_dense || known->second < 0;
  if (is_new && !too_dense) known->second = next;
  r.first_voxel = is_new ? next : known->second;
  r.first_brick = -1;
  r.bits = 32;
  if (is_new) append_voxels(grid, static_cast<std::size_t>(r.cells[0]) * r.cells[1] * r.cells[2], data);
  if (const PackedVoxels* packed = grid.packed.get()) {
    r.first_brick = r.first_voxel;
    r.first_voxel += static_cast<int>(packed->bricks.size());
    r.bricks[0] = bricks_along(grid.width);
    r.bricks[1] = bricks_along(grid.height);
    r.bits = packed->bits;
    r.lowest = packed->low;
    r.step = packed->step;
  }
  append_cells(grid, map, beside, r, data);
  data.fields.push_back(r);
  return static_cast<int>(data.fields.size()) - 1;
}

void append_shown_volume(const Volume& volume, TextureRecord& r, LaunchData& data) {
  const VoxelGrid& grid = *volume.grid;
  r.offset = static_cast<int>(data.texels.size());
  r.width = grid.width;
  r.height = grid.height;
  r.nearest = volume.nearest;
  r.wrap = wrap_of(volume);
  const Affine map = to_voxels(volume.to_world, {grid.width, grid.height, grid.depth});
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t k = 0; k < 3; ++k) data.texels.push_back(static_cast<float>(map.linear[3 * a + k]));
    data.texels.push_back(static_cast<float>(map.shift[a]));
  }
  data.texels.push_back(std::bit_cast<float>(static_cast<std::int32_t>(grid.depth)));
  const auto channels = static_cast<std::size_t>(grid.channels);
  if (data.texels.size() + 3 * (grid.data.size() / channels) >
      static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw InputError("the textures of the scene need more than 2^31 numbers; need smaller volumes");
  for (std::size_t i = 0; i < grid.data.size(); i += channels)
    for (std::size_t c = 0; c < 3; ++c) data.texels.push_back(grid.data[i + std::min(c, channels - 1)]);
}

}  // namespace itn
