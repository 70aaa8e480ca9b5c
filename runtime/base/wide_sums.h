// Sums of integers of 64 bits that need more bits than these: the same in whatever order.
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace itn {

class WideSums {
 public:
  // To the sum of each place. As many numbers every time, up to 2^30 times.
  void add(const std::int64_t* numbers, std::size_t count) {
    high_.resize(count);
    low_.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      high_[i] += numbers[i] >> 32;
      low_[i] += numbers[i] & 0xffffffff;
    }
  }

  std::size_t size() const { return high_.size(); }
  // Sum of `count` places: first, first + step, ...
  double sum(std::size_t first, std::size_t step = 1, std::size_t count = 1) const {
    std::int64_t high = 0, low = 0;
    for (std::size_t i = 0; i < count; ++i) {
      high += high_[first + i * step];
      low += low_[first + i * step];
    }
    return std::ldexp(static_cast<double>(high), 32) + static_cast<double>(low);
  }

  // The two parts of every sum, of which several make up one by themselves: for other ranks.
  std::vector<std::int64_t>& high() { return high_; }
  std::vector<std::int64_t>& low() { return low_; }

 private:
  std::vector<std::int64_t> high_, low_;
};

}  // namespace itn
