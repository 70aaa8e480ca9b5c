#include "runtime/base/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/retried.h"

namespace itn {
namespace {

constexpr const char* part_lock = ".lock ";

// The file, locked. how: of flock(). whose: for the message, "set" or "set, part 2 of 20".
int locked(const std::string& name, int how, const std::string& whose) {
  const int file =
      retried([&] { return open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644); });
  if (file < 0) throw ResultError(name + ": cannot be written; " + std::strerror(errno));
  if (flock(file, how | LOCK_NB) == 0) return file;
  const int reason = errno;
  close(file);
  if (reason == EWOULDBLOCK)
    throw ResultError(whose + ": another process is writing into it; wait for it, or choose another folder");
  throw ResultError(name + ": cannot be locked; " + std::strerror(reason));
}

}  // namespace

FolderLock::FolderLock(const std::string& folder) {
  if (!is_writing()) return;
  make_folder(folder);
  file_ = locked(folder + "/.lock", LOCK_EX, folder);
  remove_remains(folder);
}

FolderLock::FolderLock(const std::string& folder, const std::string& part) {
  if (!is_writing()) return;
  make_folder(folder);
  file_ = locked(folder + "/.lock", LOCK_SH, folder);
  try {
    part_ = locked(folder + "/" + part_lock + part, LOCK_EX, folder + ", part " + part);
  } catch (...) {
    close(file_);
    throw;
  }
}

void remove_part_locks(const std::string& folder) {
  std::error_code error;
  for (std::filesystem::directory_iterator i(folder, error), end; !error && i != end; i.increment(error)) {
    std::error_code ignored;
    if (i->path().filename().string().rfind(part_lock, 0) == 0) std::filesystem::remove(i->path(), ignored);
  }
}

FolderLock::~FolderLock() {
  if (part_ >= 0) close(part_);
  if (file_ >= 0) close(file_);
}

}  // namespace itn
