// Work that all cores share.
#pragma once
#include <algorithm>
#include <atomic>
#include <concepts>
#include <cstddef>
#include <exception>
#include <future>
#include <mutex>
#include <thread>
#include <vector>

namespace itn {

// At least one.
inline std::size_t core_count() { return std::max(1U, std::thread::hardware_concurrency()); }

// Calls f(i) for 0 <= i < count, in any order, on all cores, or on so many threads at most; each takes the next i when
// it is done with its last. What f throws first is thrown here, once all threads have ended; no further i is begun
// then.
template <std::integral Index, class Function>
void parallel_for(Index count, const Function& f, std::size_t most = core_count()) {
  std::atomic<Index> next{0};
  std::exception_ptr failure;
  std::mutex failing;
  const auto work = [&] {
    try {
      for (Index i = next++; i < count; i = next++) f(i);
    } catch (...) {
      next = count;
      const std::lock_guard lock(failing);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> others;
    for (std::size_t t = 1; t < std::min(most, static_cast<std::size_t>(count)); ++t) others.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

// Calls both, the first on a thread of its own where `at_once`. Throws what either throws.
template <class First, class Second>
void call_both(bool at_once, const First& first, const Second& second) {
  std::future<void> other = std::async(at_once ? std::launch::async : std::launch::deferred, first);
  second();
  other.get();
}

}  // namespace itn
