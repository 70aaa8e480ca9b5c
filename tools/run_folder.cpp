#include "tools/run_folder.h"

#include <fmt/format.h>

#include <filesystem>

#include "runtime/error.h"

namespace itn::tools {

std::string network_file_of(const std::string& run) {
  if (!std::filesystem::exists(run))
    throw InputError(fmt::format("{0}: is not there; train it first: itn train DATA --network rn -o {0}", run));
  if (!std::filesystem::is_directory(run)) return run;
  const std::filesystem::path file = std::filesystem::path(run) / "network.safetensors";
  if (!std::filesystem::exists(file))
    throw InputError(fmt::format("{}: is not there; itn train DATA --network rn -o {} writes it after its first epoch",
                                 file.string(), run));
  return file.string();
}

}  // namespace itn::tools
