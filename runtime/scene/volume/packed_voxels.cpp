#include "runtime/scene/volume/packed_voxels.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "itn/error.h"

namespace itn {
namespace {

constexpr std::size_t brick_voxels = std::size_t{brick_side} * brick_side * brick_side;
constexpr std::size_t most_words = std::size_t{1} << 29;  // 2 GiB: what the device's indices and memory are for

class Packer {
 public:
  Packer(const VoxelGrid& grid, int bits, const std::string& file)
      : size_{grid.width, grid.height, grid.depth},
        channels_(static_cast<std::size_t>(grid.channels)),
        file_(file),
        values_(brick_voxels * channels_) {
    packed_.bits = bits;
    for (std::size_t a = 0; a < 3; ++a) along_[a] = bricks_along(size_[a]);
    const auto count = static_cast<std::size_t>(along_[0]) * static_cast<std::size_t>(along_[1]);
    if (count > most_words / static_cast<std::size_t>(along_[2])) fail_as_too_large();
    packed_.bricks.reserve(count * static_cast<std::size_t>(along_[2]));
  }

  PackedVoxels run(const BrickValues& brick) {
    packed_.least = std::numeric_limits<float>::infinity();
    packed_.greatest = -packed_.least;
    for_each_brick(brick, [&](const std::array<int, 3>& place) { measure(place); });
    packed_.low = packed_.least;
    if (packed_.bits < 32)
      packed_.step = (packed_.greatest - packed_.least) / static_cast<float>((1U << unsigned(packed_.bits)) - 1);
    for_each_brick(brick, [&](const std::array<int, 3>& place) { store(place); });
    const double voxels = static_cast<double>(size_[0]) * static_cast<double>(size_[1]) * static_cast<double>(size_[2]);
    packed_.mean = sum_ / (voxels * static_cast<double>(channels_));
    return std::move(packed_);
  }

 private:
  template <class F>
  void for_each_brick(const BrickValues& brick, const F& f) {
    std::array<int, 3> place{};
    for (place[2] = 0; place[2] < along_[2]; ++place[2])
      for (place[1] = 0; place[1] < along_[1]; ++place[1])
        for (place[0] = 0; place[0] < along_[0]; ++place[0]) {
          is_even_ = brick(place, values_.data());
          f(place);
        }
  }

  // Calls f(voxel, value) for each value of a brick that is in the grid.
  template <class F>
  void for_each_value(const std::array<int, 3>& place, const F& f) {
    std::array<int, 3> most{};
    for (std::size_t a = 0; a < 3; ++a) most[a] = std::min(brick_side, size_[a] - brick_side * place[a]);
    for (int z = 0; z < most[2]; ++z)
      for (int y = 0; y < most[1]; ++y)
        for (int x = 0; x < most[0]; ++x) {
          float* value = values_.data() + static_cast<std::size_t>((z * brick_side + y) * brick_side + x) * channels_;
          const std::array<int, 3> voxel{x, y, z};
          for (std::size_t c = 0; c < channels_; ++c) f(voxel, value[c]);
        }
  }

  void measure(const std::array<int, 3>& place) {
    const auto measure_one = [&](const std::array<int, 3>& voxel, float value) {
      if (!(std::abs(value) <= greatest_voxel))
        throw InputError(fmt::format("{}: voxel ({}, {}, {}) is {}; need numbers up to {:g}: mend the grid", file_,
                                     brick_side * place[0] + voxel[0], brick_side * place[1] + voxel[1],
                                     brick_side * place[2] + voxel[2], value, greatest_voxel));
      packed_.least = std::min(packed_.least, value);
      packed_.greatest = std::max(packed_.greatest, value);
    };
    if (!is_even_) return for_each_value(place, measure_one);
    for (std::size_t c = 0; c < channels_; ++c) measure_one({0, 0, 0}, values_[c]);
  }

  std::uint32_t encoded(float value) const {
    if (packed_.bits == 32) return std::bit_cast<std::uint32_t>(value);
    if (packed_.step == 0) return 0;
    const float above_half = (value - packed_.low) / packed_.step + 0.5F;  // never negative: lround's calls are slow
    return static_cast<std::uint32_t>(above_half);
  }
  float decoded(std::uint32_t number) const {
    return packed_.bits == 32 ? std::bit_cast<float>(number) : packed_.low + packed_.step * static_cast<float>(number);
  }

  void store(const std::array<int, 3>& place) {
    // Beyond the grid the brick goes on with its first voxel, so that it may still be of one value.
    std::array<std::uint32_t, 3> first{};
    for (std::size_t c = 0; c < channels_; ++c) first[c] = encoded(values_[c]);
    if (is_even_ && even_.count(first) > 0) {
      packed_.bricks.push_back(even_[first]);
      double voxels = 1;
      for (std::size_t a = 0; a < 3; ++a) voxels *= std::min(brick_side, size_[a] - brick_side * place[a]);
      for (std::size_t c = 0; c < channels_; ++c) sum_ += voxels * static_cast<double>(decoded(first[c]));
      return;
    }
    if (is_even_)
      for (std::size_t i = channels_; i < values_.size(); ++i) values_[i] = values_[i - channels_];
    numbers_.resize(values_.size());
    for (std::size_t i = 0; i < numbers_.size(); ++i) numbers_[i] = first[i % channels_];
    auto of_brick = [this](const std::array<int, 3>& v) {
      return static_cast<std::size_t>((v[2] * brick_side + v[1]) * brick_side + v[0]) * channels_;
    };
    std::size_t c = 0;
    for_each_value(place, [&](const std::array<int, 3>& voxel, float value) {
      const std::uint32_t number = encoded(value);
      numbers_[of_brick(voxel) + c] = number;
      c = (c + 1) % channels_;
      sum_ += static_cast<double>(decoded(number));
    });
    bool is_even = true;
    for (std::size_t i = channels_; i < numbers_.size() && is_even; ++i)
      is_even = numbers_[i] == numbers_[i % channels_];
    const auto next = static_cast<std::int32_t>(stored_);
    if (is_even) {
      std::array<std::uint32_t, 3> colour{};
      std::copy_n(numbers_.begin(), channels_, colour.begin());
      const auto [known, is_new] = even_.try_emplace(colour, next);
      packed_.bricks.push_back(known->second);
      if (!is_new) return;
    } else {
      packed_.bricks.push_back(next);
    }
    append();
    ++stored_;
  }

  void append() {
    const unsigned a_word = 32U / static_cast<unsigned>(packed_.bits);
    if (packed_.bricks.size() + packed_.words.size() + numbers_.size() / a_word > most_words) fail_as_too_large();
    for (std::size_t i = 0; i < numbers_.size(); i += a_word) {
      std::uint32_t word = 0;
      for (unsigned k = 0; k < a_word; ++k) word |= numbers_[i + k] << (k * static_cast<unsigned>(packed_.bits) % 32);
      packed_.words.push_back(word);
    }
  }

  [[noreturn]] void fail_as_too_large() const {
    throw InputError(fmt::format("{}: {} x {} x {} voxels take more than 2 GiB at {} bits: {}resample the grid", file_,
                                 size_[0], size_[1], size_[2], packed_.bits,
                                 packed_.bits > 8 ? "give it fewer \"bits\", or " : ""));
  }

  std::array<int, 3> size_, along_{};
  std::size_t channels_;
  const std::string& file_;
  std::vector<float> values_;
  std::vector<std::uint32_t> numbers_;
  PackedVoxels packed_;
  bool is_even_ = false;    // the brick being looked at, as its reader says
  std::size_t stored_ = 0;  // bricks
  double sum_ = 0;
  std::map<std::array<std::uint32_t, 3>, std::int32_t> even_;  // bricks of one value
};

}  // namespace

float PackedVoxels::value(std::size_t value) const {
  if (bits == 32) return std::bit_cast<float>(words[value]);
  const unsigned shift = bits == 8 ? 2 : 1;  // 4 or 2 numbers a word
  const std::uint32_t number = words[value >> shift] >> ((value & ((1U << shift) - 1)) * static_cast<unsigned>(bits));
  return low + step * static_cast<float>(number & ((1U << static_cast<unsigned>(bits)) - 1));
}

std::size_t PackedVoxels::voxel(const std::array<int, 2>& along, int x, int y, int z) const {
  const std::int64_t row = std::int64_t{z / brick_side} * along[1] + y / brick_side;
  const std::int32_t brick = bricks[static_cast<std::size_t>(row * along[0] + x / brick_side)];
  const int in_brick = (z % brick_side * brick_side + y % brick_side) * brick_side + x % brick_side;
  return static_cast<std::size_t>(brick) * brick_voxels + static_cast<std::size_t>(in_brick);
}

PackedVoxels pack(const VoxelGrid& grid, int bits, const std::string& file, const BrickValues& values) {
  return Packer(grid, bits, file).run(values);
}

VoxelRange range_of(const VoxelGrid& grid) {
  if (grid.packed) return {grid.packed->least, grid.packed->greatest};
  const auto [least, greatest] = std::minmax_element(grid.data.begin(), grid.data.end());
  return {*least, *greatest};
}

double mean_of(const VoxelGrid& grid) {
  if (grid.packed) return grid.packed->mean;
  return std::accumulate(grid.data.begin(), grid.data.end(), 0.0) / static_cast<double>(grid.data.size());
}

}  // namespace itn
