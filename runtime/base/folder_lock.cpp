#include "runtime/base/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "runtime/base/error.h"

namespace itn {

FolderLock::FolderLock(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw ResultError(folder + ": cannot be created; " + error.message());
  const std::string name = folder + "/.lock";
  file_ = open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file_ < 0) throw ResultError(name + ": cannot be written; " + std::strerror(errno));
  if (flock(file_, LOCK_EX | LOCK_NB) == 0) return;
  const int reason = errno;
  close(file_);
  if (reason == EWOULDBLOCK)
    throw ResultError(folder + ": another process is writing into it; wait for it, or choose another folder");
  throw ResultError(name + ": cannot be locked; " + std::strerror(reason));
}

FolderLock::~FolderLock() { close(file_); }

}  // namespace itn
