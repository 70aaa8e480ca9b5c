// Random draws of training: streams and orders, from the counters of runtime/base/random.h.
#pragma once
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "runtime/base/random.h"

namespace itn {

// Purposes of random numbers; further streams of one purpose (a layer, an epoch) are added to it.
enum RandomStream : std::uint64_t {
  RANDOM_WEIGHTS = 0,
  RANDOM_ORDER = std::uint64_t(1) << 32,
  RANDOM_NOISE = std::uint64_t(1) << 40,
  RANDOM_FAULT = std::uint64_t(1) << 50,
  RANDOM_FLASH = std::uint64_t(1) << 60  // and another: of what belongs to it
};

// 0 .. count - 1 in random order (Fisher and Yates). The modulo's bias is below count / 2^64.
inline std::vector<std::size_t> random_order(std::uint64_t seed, std::uint64_t stream, std::size_t count) {
  std::vector<std::size_t> order(count);
  for (std::size_t i = 0; i < count; ++i) order[i] = i;
  for (std::size_t i = count; i > 1; --i) std::swap(order[i - 1], order[random_bits(seed, stream, i) % i]);
  return order;
}

}  // namespace itn
