#include "runtime/render/device/kernel_cache.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace itn {

std::string kernel_cache_folder() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value ? value : "");
  };
  if (std::string own = variable("POCL_CACHE_DIR"); !own.empty()) return own;
  if (const std::string caches = variable("XDG_CACHE_HOME"); !caches.empty()) return caches + "/pocl/kcache";
  if (const std::string home = variable("HOME"); !home.empty()) return home + "/.cache/pocl/kcache";
  return "/tmp/pocl/kcache";
}

std::string kernel_cache_fault() {
  const std::string folder = kernel_cache_folder();
  std::error_code error;
  // It is made where it is missing, in what is there of those above it.
  std::filesystem::path there = std::filesystem::absolute(folder, error);
  while (!std::filesystem::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  const std::string remedy = "; make it a folder that you may write to, or set POCL_CACHE_DIR to one";
  if (!std::filesystem::is_directory(there, error)) return there.string() + " is no folder" + remedy;
  if (access(there.c_str(), W_OK | X_OK) == 0) return "";
  return there.string() + ": " + std::strerror(errno) + remedy;
}

}  // namespace itn
