#include "runtime/base/limits.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <array>
#include <cstdint>

namespace itn {

std::string limits_in_force() {
  struct Limit {
    __rlimit_resource resource;
    const char* option;
    std::uint64_t unit;    // of the shell's number
    std::uint64_t enough;  // in these units: nothing fails for that much
  };
  constexpr std::uint64_t any = ~std::uint64_t{0};
  constexpr std::array all{Limit{RLIMIT_AS, "-v", 1024, any},     Limit{RLIMIT_DATA, "-d", 1024, any},
                           Limit{RLIMIT_STACK, "-s", 1024, 1024}, Limit{RLIMIT_FSIZE, "-f", 1024, any},
                           Limit{RLIMIT_NOFILE, "-n", 1, 256},    Limit{RLIMIT_NPROC, "-u", 1, 4096}};
  std::string text;
  for (const Limit& each : all) {
    rlimit limit{};
    if (getrlimit(each.resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY ||
        limit.rlim_cur / each.unit >= each.enough)
      continue;
    text += fmt::format("{} {} {}", text.empty() ? "; the shell's limits may be why: ulimit" : ",", each.option,
                        limit.rlim_cur / each.unit);
  }
  return text;
}

}  // namespace itn
