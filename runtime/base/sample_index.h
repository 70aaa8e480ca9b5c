// Samples of a seed are counted from 0, in an int.
#pragma once
#include <cstdint>
#include <limits>
#include <string>

#include "itn/error.h"

namespace itn {

// The sample after `more` ones from `first` on. Throws UsageError where a seed has not as many.
inline int following_sample(std::int64_t first, std::int64_t more) {
  constexpr std::int64_t most = std::numeric_limits<int>::max();
  if (more > most - first)
    throw UsageError("samples " + std::to_string(first) + " to " + std::to_string(first + more - 1) +
                     " of a pixel: a seed has " + std::to_string(most) + "; take fewer of them, or another seed");
  return static_cast<int>(first + more);
}

}  // namespace itn
