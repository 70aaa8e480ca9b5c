#include "tools/itn/passive_wait.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "tools/itn/hold_signals.h"

namespace itn::tools {

void wait_asleep(char** argv) {
  constexpr const char* variable = "OMP_WAIT_POLICY";
  constexpr const char* itself = "/proc/self/exe";
  if (std::getenv(variable)) return;
  setenv(variable, "passive", 0);
  hold_signals();
  // By its own path where that can be reached: it is the name that `ps` shows.
  std::error_code error;
  const std::filesystem::path path = std::filesystem::read_symlink(itself, error);
  if (!error) execv(path.c_str(), argv);
  execv(itself, argv);
}

}  // namespace itn::tools
