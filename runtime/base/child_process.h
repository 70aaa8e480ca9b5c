// Foreign libraries that read foreign files crash, hang and ask for all memory where a file is broken: they do so in a
// process of their own.
#pragma once
#include <cstdint>
#include <functional>
#include <string>

namespace itn {

struct ChildLimits {
  std::uint64_t bytes = std::uint64_t{8} << 30;  // beyond what this process has now
  unsigned seconds = 120;                        // of CPU time
  unsigned wall_seconds = 1200;                  // on a busy machine; a reader may also wait for what never comes
};

// Runs `work` in a child process and returns its result. Throws InputError: `work` threw an exception (its message), or
// the child crashed or ran into its limits ("crashes the reader", "takes more than ...").
std::string in_child_process(const std::function<std::string()>& work, const ChildLimits& limits = {});

}  // namespace itn
