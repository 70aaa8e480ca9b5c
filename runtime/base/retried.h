// Calls of the system that a signal may interrupt before they have done anything.
#pragma once
#include <cerrno>

namespace itn {

template <class Call>
auto retried(const Call& call) {
  for (;;)
    if (const auto result = call(); result != -1 || errno != EINTR) return result;
}

}  // namespace itn
