#include "tools/run_folder.h"

#include <filesystem>

#include "runtime/error.h"

namespace itn::tools {

std::string network_file_of(const std::string& run) {
  if (!std::filesystem::is_directory(run)) return run;
  const std::filesystem::path file = std::filesystem::path(run) / "network.safetensors";
  if (!std::filesystem::exists(file))
    throw InputError(file.string() + ": is not there; itn train writes it with its first checkpoint after an epoch");
  return file.string();
}

}  // namespace itn::tools
