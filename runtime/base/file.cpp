#include "itn/file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <list>

#include "itn/error.h"
#include "runtime/base/inputs.h"
#include "runtime/base/private_file.h"
#include "runtime/base/retried.h"

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
  else if (error == ENAMETOOLONG)
    message += "; choose a shorter name";
  else if (error == EFBIG)
    message += "; the shell allows no files of this size (ulimit -f): raise it";
  else if (error == EMFILE)
    message += "; the shell allows too few (ulimit -n): raise it";
  else if (error == ENXIO)
    message += "; nobody reads from it: begin to read first, or give the name of a file";
  throw ResultError(message);
}

[[noreturn]] void fail_to_read(const std::string& path, const std::string& why) {
  throw InputError(path + ": cannot be read; " + why);
}

bool is_special(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

// The name of the temporary file that is open, for remove_unfinished_file: a signal handler may touch no std::string.
char unfinished[4096];
std::atomic<bool> has_unfinished{false};

std::atomic<bool> writing{true};

constexpr std::string_view temporary_mark = ".tmp-";
constexpr std::size_t temporary_digits = 16;

// The file's name, shortened so that the temporary name stays within the 255 bytes that a name may have.
std::string beginning_of(const std::string& name) {
  constexpr std::size_t longest_name = 255;
  return name.substr(0, longest_name - temporary_mark.size() - temporary_digits);
}

// A name that nobody can have foreseen: where others may write into the folder, too, they could have put a link there.
fs::path temporary_name(const fs::path& target) {
  std::uint64_t bits = 0;
  if (getrandom(&bits, sizeof bits, 0) != static_cast<ssize_t>(sizeof bits)) fail(target, errno);
  std::string name = beginning_of(target.filename().string()) + std::string(temporary_mark);
  for (std::size_t i = 0; i < temporary_digits; ++i) name += "0123456789abcdef"[bits >> (4 * i) & 15];
  return target.parent_path() / name;
}

bool is_temporary(const std::string& name) {
  const std::size_t tail = temporary_mark.size() + temporary_digits;
  return name.size() > tail && name.compare(name.size() - tail, temporary_mark.size(), temporary_mark) == 0 &&
         name.find_first_not_of("0123456789abcdef", name.size() - temporary_digits) == std::string::npos;
}

// The users who may read a new file: those whom the umask lets, or its owner alone.
enum class Readers { many, owner };

// An open file that is removed again unless kept.
class Output {
 public:
  // A file or device that is there.
  explicit Output(const fs::path& target) : target_(target), written_(target) {
    // A pipe would wait for a reader, who may never come; what is then written may wait.
    descriptor_ = retried([&] { return ::open(written_.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK); });
    if (descriptor_ < 0) fail(target_, errno);
    if (const int flags = ::fcntl(descriptor_, F_GETFL); flags >= 0) ::fcntl(descriptor_, F_SETFL, flags & ~O_NONBLOCK);
  }
  // A new one beside the target. It is locked as long as its process lives: remove_remains() knows by that.
  static Output temporary(const fs::path& target, Readers readers = Readers::many) { return Output(target, readers); }
  ~Output() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (remove_) {
      ::unlink(written_.c_str());
      has_unfinished = false;
    }
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  void write(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t n = retried([&] { return ::write(descriptor_, bytes.data(), bytes.size()); });
      if (n < 0) fail(target_, errno);
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
  }
  // Without it the name could be there after a power cut, and the bytes not.
  void sync() const {
    if (retried([&] { return ::fsync(descriptor_); }) != 0 && errno != EINVAL && errno != ENOSYS) fail(target_, errno);
  }
  void close() {
    const int result = ::close(descriptor_);
    descriptor_ = -1;
    if (result != 0 && errno != EINTR) fail(target_, errno);  // interrupted: closed all the same
  }
  void rename() {
    if (::rename(written_.c_str(), target_.c_str()) != 0) fail(target_, errno);
    remove_ = has_unfinished = false;
    close();
  }

 private:
  Output(const fs::path& target, Readers readers) : target_(target) {
    constexpr int tries = 100;
    for (int i = 0; i < tries && descriptor_ < 0; ++i) open_new(readers == Readers::owner ? 0600 : 0666);
    if (descriptor_ < 0) fail(target_, EEXIST);
  }
  void open_new(mode_t mode) {
    written_ = temporary_name(target_);
    if (written_.native().size() >= sizeof unfinished) fail(target_, ENAMETOOLONG);
    std::strcpy(unfinished, written_.c_str());
    descriptor_ =
        retried([&] { return ::open(written_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode); });
    if (descriptor_ < 0 && errno == EEXIST) return;
    if (descriptor_ < 0) fail(target_, errno);
    remove_ = has_unfinished = true;
    struct stat status {};
    retried([&] {
      return ::flock(descriptor_, LOCK_EX);
    });  // fails where a file system has no locks: its files are then never removed
    if (::fstat(descriptor_, &status) == 0 && status.st_nlink > 0) return;
    ::close(descriptor_);  // taken for remains between its creation and its lock
    descriptor_ = -1;
    remove_ = has_unfinished = false;
  }

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

fs::path checked_target(const std::string& path) {
  refuse_input(path);
  fs::path target = resolved(path);
  std::error_code error;
  if (target.filename().empty() || fs::is_directory(target, error))
    throw ResultError(target.string() + ": is a folder; give a file name");
  return target;
}

// A temporary file that no living process has locked.
void remove_if_left(const fs::path& file) {
  const int descriptor = retried([&] { return ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK); });
  if (descriptor < 0) return;
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) ::unlink(file.c_str());
  ::close(descriptor);
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

void require_regular(const std::string& path, const struct stat& status) {
  if (S_ISDIR(status.st_mode)) throw InputError(path + ": is a folder; give a file");
  if (!S_ISREG(status.st_mode))
    throw InputError(path + ": is a pipe, a socket or a device; need a file: save to one what it gives");
}

std::string gib(std::uint64_t bytes) { return std::to_string((bytes + (std::uint64_t{1} << 30) - 1) >> 30) + " GiB"; }

}  // namespace

bool set_writing(bool on) { return writing.exchange(on); }
bool is_writing() { return writing; }

namespace {

void write_for(const std::string& path, std::string_view bytes, Sync sync, Readers readers) {
  if (!writing) return;
  if (is_special(path)) {
    Output output(path);
    output.write(bytes);
    output.close();
    return;
  }
  Output output = Output::temporary(checked_target(path), readers);
  output.write(bytes);
  if (sync == Sync::now) output.sync();
  output.rename();
}

}  // namespace

void write_file(const std::string& path, std::string_view bytes, Sync sync) {
  write_for(path, bytes, sync, Readers::many);
}

void write_private_file(const std::string& path, std::string_view bytes) {
  write_for(path, bytes, Sync::now, Readers::owner);
}

void sync_folder(const std::string& folder) {
  const Descriptor opened(retried([&] { return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); }));
  if (opened.number() < 0 || retried([&] { return ::syncfs(opened.number()); }) != 0) fail(folder, errno);
}

void remove_unfinished_file() noexcept {
  if (has_unfinished) ::unlink(unfinished);
}

void check_writable(const std::string& path) {
  if (!writing) return;
  if (is_special(path)) {
    static std::list<Output> pipes;
    std::error_code error;
    if (fs::is_fifo(path, error))
      pipes.emplace_back(path);
    else
      const Output output(path);
    return;
  }
  const fs::path target = checked_target(path);
  remove_remains(target.has_parent_path() ? target.parent_path().string() : ".", target.filename().string());
  Output::temporary(target);
}

void remove_remains(const std::string& folder, const std::string& of) {
  std::error_code error;
  for (fs::directory_iterator i(folder, error), end; !error && i != end; i.increment(error)) {
    const std::string name = i->path().filename().string();
    if (is_temporary(name) && (of.empty() || name.rfind(beginning_of(of) + std::string(temporary_mark), 0) == 0))
      remove_if_left(i->path());
  }
}

bool is_there(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 || (errno != ENOENT && errno != ENOTDIR);
}

bool is_reachable(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0;
}

bool is_folder(const std::string& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

void make_folder(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error && !is_folder(folder)) throw ResultError(folder + ": cannot be created; " + error.message());
}

void check_regular_file(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || ::access(path.c_str(), R_OK) != 0) fail_to_read(path, std::strerror(errno));
  require_regular(path, status);
}

std::string read_file(const std::string& path, std::uint64_t most) {
  // Asked before it is opened, and again after: opening a device may move it, and names may change their meaning.
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) fail_to_read(path, std::strerror(errno));
  require_regular(path, status);
  const Descriptor file(retried([&] { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY); }));
  if (file.number() < 0 || ::fstat(file.number(), &status) != 0) fail_to_read(path, std::strerror(errno));
  require_regular(path, status);
  const auto size = static_cast<std::uint64_t>(status.st_size);
  if (size > most) throw InputError(path + ": has " + gib(size) + "; at most " + gib(most) + " are read");
  std::string bytes(size, '\0');
  std::size_t done = 0;
  for (;;) {
    if (done == bytes.size()) {  // at the end, or a file whose size says nothing, as those of /proc
      constexpr std::size_t step = 1 << 16;
      char more[step];
      const ssize_t n = retried([&] { return ::read(file.number(), more, step); });
      if (n < 0) fail_to_read(path, std::strerror(errno));
      if (n == 0) break;
      bytes.append(more, static_cast<std::size_t>(n));
      done = bytes.size();
      if (done > most) throw InputError(path + ": grows while it is read; at most " + gib(most) + " are read");
      continue;
    }
    const ssize_t n = retried([&] { return ::read(file.number(), bytes.data() + done, bytes.size() - done); });
    if (n < 0) fail_to_read(path, std::strerror(errno));
    if (n == 0) bytes.resize(done);
    done += static_cast<std::size_t>(n);
  }
  note_input(path, bytes);
  return bytes;
}

}  // namespace itn
