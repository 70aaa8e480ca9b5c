// The files of a folder, to compare it with another or with itself later.
#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "itn/file.h"

// Contents by name, from the folder on.
inline std::map<std::string, std::string> files_of(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[std::filesystem::relative(entry.path(), folder).string()] = itn::read_file(entry.path().string());
  return files;
}
