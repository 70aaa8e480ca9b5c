// Loops on all cores do what loops on one do.
#include "runtime/base/parallel.h"

#include <catch2/catch.hpp>
#include <set>
#include <stdexcept>

using namespace itn;

TEST_CASE("parallel_for calls every index once, also where there are fewer than cores or none") {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{10'000}}) {
    std::vector<std::atomic<int>> calls(count);
    parallel_for(count, [&](std::size_t i) { ++calls[i]; });
    std::size_t once = 0;
    for (const auto& c : calls) once += c == 1;
    CHECK(once == count);
  }
}

TEST_CASE("parallel_for uses no more threads than it may") {
  std::mutex adding;
  std::set<std::thread::id> threads;
  const auto note = [&](int) {
    const std::lock_guard lock(adding);
    threads.insert(std::this_thread::get_id());
  };
  parallel_for(1000, note, 1);
  CHECK(threads == std::set{std::this_thread::get_id()});
  parallel_for(1000, note, 3);
  CHECK(threads.size() <= 3);
}

TEST_CASE("parallel_for throws what a call throws, and begins few others after it") {
  std::atomic<int> calls{0};
  const auto fail_early = [&](int i) {
    ++calls;
    if (i == 3) throw std::runtime_error("three");
    std::this_thread::sleep_for(std::chrono::microseconds(20));
  };
  CHECK_THROWS_WITH(parallel_for(100'000, fail_early), "three");
  CHECK(calls < 100'000);
}

TEST_CASE("call_both calls both, and throws what either throws") {
  for (const bool at_once : {false, true}) {
    int first = 0, second = 0;
    call_both(
        at_once, [&] { first = 1; }, [&] { second = 2; });
    CHECK(first == 1);
    CHECK(second == 2);
    const auto nothing = [] {};
    const auto fail = [] { throw std::runtime_error("one of both"); };
    CHECK_THROWS_WITH(call_both(at_once, fail, nothing), "one of both");
    CHECK_THROWS_WITH(call_both(at_once, nothing, fail), "one of both");
  }
}
