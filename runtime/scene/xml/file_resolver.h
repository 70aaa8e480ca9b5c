// Finds the files that a scene names: the order of folders is that of Mitsuba's file resolver.
#pragma once
#include <string>
#include <vector>

namespace itn {

class FileResolver {
 public:
  // Starts with the folder of a scene file, then the current one.
  explicit FileResolver(const std::string& scene_file);

  // Looked in before all others.
  void prepend(const std::string& folder);
  // Looked in after all others.
  void append(const std::string& folder);

  // The first of the folders that has `name` (a file or a folder), joined with it; empty when none has. An absolute
  // name stands for itself.
  std::string find(const std::string& name) const;

  const std::vector<std::string>& folders() const { return folders_; }

 private:
  std::vector<std::string> folders_;
};

// Its folder; "." for a bare name.
std::string folder_of(const std::string& file);

}  // namespace itn
