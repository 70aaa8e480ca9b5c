// Work in a child process leaves no trace outside of it.
#include "runtime/base/child_process.h"

#include <atomic>
#include <catch2/catch.hpp>
#include <csignal>
#include <new>
#include <stdexcept>

#include "itn/error.h"

using namespace itn;

TEST_CASE("a child's answer arrives whole") {
  const std::string large(3 << 20, 'x');
  CHECK(in_child_process([&] { return large; }) == large);
  CHECK(in_child_process([] { return std::string(); }).empty());
}

TEST_CASE("a child's exceptions, crashes and excesses are input errors") {
  const auto message = [](const std::function<std::string()>& work, const ChildLimits& limits = {}) {
    try {
      in_child_process(work, limits);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  CHECK(message([]() -> std::string { throw std::runtime_error("no such thing"); }) == "no such thing");
  CHECK(message([]() -> std::string { throw std::bad_alloc(); }).find("GiB") != std::string::npos);
  CHECK(message([]() -> std::string {
          std::raise(SIGSEGV);
          return "";
        }).find("crashes") != std::string::npos);
#if !defined(__SANITIZE_ADDRESS__)  // which allocates otherwise
  CHECK(message([] { return std::string(std::size_t{3} << 30, 'x'); }, {std::uint64_t{1} << 30, 10}) ==
        "takes more than 1 GiB to read");
#endif
  CHECK(message(
            []() -> std::string {
              std::atomic<int> turns = 0;
              for (;;) ++turns;
            },
            {std::uint64_t{1} << 30, 1}) == "takes more than 1 s to read");
}
