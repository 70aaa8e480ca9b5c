#include <filesystem>
#include <fstream>
#include <utility>

#include "tests/fuzz/input_files.h"
#include "tests/support/temporary_folder.h"

namespace itn::fuzz {
namespace {

const std::string& folder() {
  static const TemporaryFolder one;
  static const std::string path = one / "";
  return path;
}

}  // namespace

InputFiles::InputFiles(std::map<std::string, std::string> bytes) : bytes_(std::move(bytes)) {
  for (const auto& [name, content] : bytes_) std::ofstream(path(name), std::ios::binary) << content;
}
InputFiles::~InputFiles() {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder(), error))
    std::filesystem::remove_all(entry.path(), error);
}
std::string InputFiles::path(const std::string& name) const { return folder() + name; }

}  // namespace itn::fuzz
