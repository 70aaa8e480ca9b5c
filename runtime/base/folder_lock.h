// One writer a folder, or several who have agreed on who writes what.
#pragma once
#include <string>

namespace itn {

// Holds the folder, which is made where it is missing, until destroyed or until the process ends, however it ends. A
// process that writes nothing (file.h) holds nothing.
class FolderLock {
 public:
  // Throws ResultError: another process holds it, or it cannot be made.
  explicit FolderLock(const std::string& folder);
  // Beside processes that hold other parts of the folder, but beside none that holds all of it, nor this part. part: as
  // it may stand in a file's name and in a message, "2 of 20".
  FolderLock(const std::string& folder, const std::string& part);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int file_ = -1, part_ = -1;
};

// Removes what locks of parts have left. For who holds the whole folder.
void remove_part_locks(const std::string& folder);

}  // namespace itn
