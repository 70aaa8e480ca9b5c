#include "runtime/base/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "runtime/base/error.h"

namespace itn {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, int error) {
  std::string message = path.string() + ": cannot be written; " + std::strerror(error);
  if (error == ENOENT)
    message += "; create the folder " + (path.has_parent_path() ? path.parent_path().string() : ".");
  else if (error == EACCES || error == EPERM || error == EROFS)
    message += "; choose a folder you may write to";
  else if (error == ENOSPC || error == EDQUOT)
    message += "; make room or choose another folder";
  throw ResultError(message);
}

bool is_special(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

// The name of the temporary file that is open, for remove_unfinished_file: a signal handler may touch no std::string.
char unfinished[4096];
std::atomic<bool> has_unfinished{false};

// An open file that is removed again unless kept.
class Output {
 public:
  Output(const fs::path& target, fs::path written, int flags) : target_(target), written_(std::move(written)) {
    if (flags & O_CREAT) {
      if (written_.native().size() >= sizeof unfinished) fail(target_, ENAMETOOLONG);
      std::strcpy(unfinished, written_.c_str());
      has_unfinished = true;
    }
    descriptor_ = ::open(written_.c_str(), O_WRONLY | O_CLOEXEC | flags, 0666);
    if (descriptor_ < 0) {
      has_unfinished = false;
      fail(target_, errno);
    }
    remove_ = (flags & O_CREAT) != 0;
  }
  ~Output() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (remove_) ::unlink(written_.c_str());
    has_unfinished = false;
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  void write(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t n = ::write(descriptor_, bytes.data(), bytes.size());
      if (n < 0 && errno != EINTR) fail(target_, errno);
      if (n > 0) bytes.remove_prefix(static_cast<std::size_t>(n));
    }
  }
  void close() {
    const int result = ::close(descriptor_);
    descriptor_ = -1;
    if (result != 0) fail(target_, errno);
  }
  void rename() {
    if (::rename(written_.c_str(), target_.c_str()) != 0) fail(target_, errno);
    remove_ = has_unfinished = false;
  }

 private:
  fs::path target_, written_;
  int descriptor_ = -1;
  bool remove_ = false;
};

// The file that a path stands for, when it is a symbolic link to a file that exists.
fs::path resolved(const fs::path& path) {
  std::error_code error;
  const fs::path target = fs::canonical(path, error);
  return error ? path : target;
}

Output open_temporary(const fs::path& target) {
  if (target.filename().empty() || fs::is_directory(target))
    throw ResultError(target.string() + ": is a folder; give a file name");
  fs::path temporary = target;
  temporary += ".tmp" + std::to_string(::getpid());
  return Output(target, temporary, O_CREAT | O_TRUNC);
}

}  // namespace

void write_file(const std::string& path, std::string_view bytes) {
  if (is_special(path)) {
    Output output(path, path, 0);
    output.write(bytes);
    output.close();
    return;
  }
  Output output = open_temporary(resolved(path));
  output.write(bytes);
  output.close();
  output.rename();
}

void remove_unfinished_file() noexcept {
  if (has_unfinished) ::unlink(unfinished);
}

void check_writable(const std::string& path) {
  if (is_special(path))
    Output(path, path, 0);
  else
    open_temporary(resolved(path));
}

std::string read_file(const std::string& path) {
  if (fs::is_directory(path)) throw InputError(path + ": is a folder; give a file");
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  std::ostringstream bytes;
  if (in) bytes << in.rdbuf();
  if (!in) throw InputError(path + ": cannot be read; " + std::strerror(errno ? errno : EIO));
  return std::move(bytes).str();
}

}  // namespace itn
