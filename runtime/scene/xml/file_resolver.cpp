#include "runtime/scene/xml/file_resolver.h"

#include <algorithm>
#include <filesystem>

#include "itn/file.h"

namespace itn {

namespace fs = std::filesystem;

std::string folder_of(const std::string& file) {
  const std::string folder = fs::path(file).parent_path().string();
  return folder.empty() ? "." : folder;
}

FileResolver::FileResolver(const std::string& scene_file) : folders_{folder_of(scene_file), "."} {}

void FileResolver::prepend(const std::string& folder) { folders_.insert(folders_.begin(), folder); }

void FileResolver::append(const std::string& folder) {
  if (std::find(folders_.begin(), folders_.end(), folder) == folders_.end()) folders_.push_back(folder);
}

std::string FileResolver::find(const std::string& name) const {
  if (fs::path(name).is_absolute()) return is_there(name) ? name : "";
  std::string unreachable;  // its reader says why
  for (const std::string& folder : folders_) {
    std::string candidate = folder == "." ? name : (fs::path(folder) / name).string();
    if (is_reachable(candidate)) return candidate;
    if (unreachable.empty() && is_there(candidate)) unreachable = candidate;
  }
  return unreachable;
}

}  // namespace itn
