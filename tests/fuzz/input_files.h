// The files that a reader finds: on the disk in the replay (disk_files.cpp), in memory in the fuzzers
// (memory_files.cpp), which would otherwise do little else than create and remove files.
#pragma once
#include <map>
#include <string>

namespace itn::fuzz {

// Files by their names in one folder. One at a time.
class InputFiles {
 public:
  explicit InputFiles(std::map<std::string, std::string> bytes);
  ~InputFiles();
  InputFiles(const InputFiles&) = delete;
  InputFiles& operator=(const InputFiles&) = delete;

  std::string path(const std::string& name) const;

 private:
  std::map<std::string, std::string> bytes_;
};

}  // namespace itn::fuzz
