#include "runtime/base/memory.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <limits>

#include "itn/error.h"

namespace itn {

std::uint64_t free_memory() {
  std::uint64_t bytes = std::numeric_limits<std::uint64_t>::max();
  std::ifstream file("/proc/meminfo");
  std::uint64_t kib = 0;
  for (std::string name; file >> name; file.ignore(std::numeric_limits<std::streamsize>::max(), '\n'))
    if (name == "MemAvailable:" && file >> kib) bytes = kib << 10;
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
    bytes = std::min<std::uint64_t>(bytes, limit.rlim_cur);
  return bytes;
}

void require_memory(double bytes, const std::string& what, const std::string& remedy) {
  const auto there = static_cast<double>(free_memory());
  if (bytes <= there) return;
  constexpr double gib = 1 << 30;
  throw InputError(fmt::format("{} takes {:.1f} GiB of memory, and {:.1f} GiB are free; {}", what, bytes / gib,
                               there / gib, remedy));
}

}  // namespace itn
