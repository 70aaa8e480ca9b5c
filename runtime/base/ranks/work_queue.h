// Items that ranks take, at first many at once and towards the end few, so that all end together.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>

namespace itn {

// First item and end of what a rank is given to do; empty: there is no more.
using WorkRange = std::array<std::uint64_t, 2>;

class WorkQueue {
 public:
  // most: at once.
  WorkQueue(std::size_t count, std::size_t most, int ranks)
      : count_(count), most_(most), ranks_(static_cast<std::size_t>(ranks)) {}

  // From any thread.
  WorkRange take() {
    const std::lock_guard lock(mutex_);
    constexpr std::size_t turns = 3;  // that each rank still has, about
    const std::size_t rest = count_ - next_, size = std::clamp<std::size_t>(rest / (turns * ranks_), 1, most_);
    const std::size_t first = next_;
    next_ = std::min(count_, first + size);
    return {first, next_};
  }

 private:
  std::mutex mutex_;
  std::size_t count_, most_, ranks_, next_ = 0;
};

}  // namespace itn
