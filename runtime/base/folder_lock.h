// One writer a folder.
#pragma once
#include <string>

namespace itn {

// Holds the folder, which is made where it is missing, until destroyed or until the process ends, however it ends.
// Throws ResultError: another process holds it, or it cannot be made.
class FolderLock {
 public:
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int file_ = -1;
};

}  // namespace itn
