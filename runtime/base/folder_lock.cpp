#include "runtime/base/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "runtime/base/error.h"
#include "runtime/base/file.h"

namespace itn {

FolderLock::FolderLock(const std::string& folder) {
  make_folder(folder);
  const std::string name = folder + "/.lock";
  file_ = open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644);
  if (file_ < 0) throw ResultError(name + ": cannot be written; " + std::strerror(errno));
  if (flock(file_, LOCK_EX | LOCK_NB) == 0) {
    remove_remains(folder);
    return;
  }
  const int reason = errno;
  close(file_);
  if (reason == EWOULDBLOCK)
    throw ResultError(folder + ": another process is writing into it; wait for it, or choose another folder");
  throw ResultError(name + ": cannot be locked; " + std::strerror(reason));
}

FolderLock::~FolderLock() { close(file_); }

}  // namespace itn
