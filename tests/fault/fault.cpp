// Preloaded into itn (LD_PRELOAD) by tools/lab/fault_matrix.py: the n-th call of a system function on files of one
// folder fails. Calls on other files, as those of the loader and of the OpenCL driver, neither count nor fail.
//
//   ITN_FAULT_FOLDER  the folder, absolute and without links
//   ITN_FAULT_CALL    open, read, write, fsync, rename, close, mkdir or new: operator new where the program itself
//                     calls it, from the beginning of main() on: before that it can say nothing
//   ITN_FAULT_AT      which call, from 1 on; 0: none
//   ITN_FAULT_ERROR   a number of errno, with which it fails; 0: it reads or writes one byte alone
//   ITN_FAULT_COUNT   a file that gets a line for each of these calls at the end of the program: its name and how often
//                     it was called. Of new also a line "site KEY FIRST LAST" for each place in the program that calls
//                     it: which the first and the last of its calls were; and "failed KEY" when the call fails
//   ITN_FAULT_STACK   how many of the nearest functions of the program on the stack make a place
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <link.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <new>

namespace {

const char* setting(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

struct Plan {
  const char* folder = setting("ITN_FAULT_FOLDER");
  const char* call = setting("ITN_FAULT_CALL");
  long at = std::atol(setting("ITN_FAULT_AT"));
  int error = std::atoi(setting("ITN_FAULT_ERROR"));
  int stack = std::atoi(setting("ITN_FAULT_STACK"));
  const char* count_file = setting("ITN_FAULT_COUNT");
};

const Plan& plan() {
  static const Plan one;
  return one;
}

enum Call { open_call, read_call, write_call, fsync_call, rename_call, close_call, mkdir_call, new_call, calls };
constexpr std::array<const char*, calls> names{"open", "read", "write", "fsync", "rename", "close", "mkdir", "new"};
std::array<std::atomic<long>, calls> counts{};

bool is_planned(Call call, long n) { return n == plan().at && std::strcmp(names[call], plan().call) == 0; }

// Counts a call. Is it the one that fails?
bool fails(Call call) { return is_planned(call, ++counts[call]); }

bool is_in_folder(const char* path) {
  const std::size_t length = std::strlen(plan().folder);
  if (length == 0) return false;
  std::array<char, 8192> whole{};
  if (path[0] != '/') {
    if (!getcwd(whole.data(), whole.size() / 2)) return false;
    std::strncat(whole.data(), "/", whole.size() - std::strlen(whole.data()) - 1);
  }
  std::strncat(whole.data(), path, whole.size() - std::strlen(whole.data()) - 1);
  return std::strncmp(whole.data(), plan().folder, length) == 0 && (whole[length] == '/' || whole[length] == '\0');
}

// The descriptors that are open files of the folder.
std::array<std::atomic<bool>, 4096> is_open{};

bool is_tracked(int file) {
  return file >= 0 && static_cast<std::size_t>(file) < is_open.size() && is_open[static_cast<std::size_t>(file)];
}
int track(int file) {
  if (file >= 0 && static_cast<std::size_t>(file) < is_open.size()) is_open[static_cast<std::size_t>(file)] = true;
  return file;
}

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

int fail() {
  errno = plan().error;
  return -1;
}

int opened(const char* path, int flags, mode_t mode, int at, const char* name) {
  const bool is_ours = is_in_folder(path);
  if (is_ours && fails(open_call)) return fail();
  const int file = at == AT_FDCWD ? next<int(const char*, int, mode_t)>(name)(path, flags, mode)
                                  : next<int(int, const char*, int, mode_t)>(name)(at, path, flags, mode);
  return is_ours ? track(file) : file;
}

mode_t mode_of(int flags, va_list rest) { return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0; }

std::FILE* opened_stream(const char* path, const char* mode, const char* name) {
  const bool is_ours = is_in_folder(path);
  if (is_ours && fails(open_call)) {
    fail();
    return nullptr;
  }
  std::FILE* stream = next<std::FILE*(const char*, const char*)>(name)(path, mode);
  if (is_ours && stream) track(fileno(stream));
  return stream;
}

// The program's own code, without its libraries.
struct Code {
  std::uintptr_t begin = UINTPTR_MAX, end = 0;
  Code() {
    dl_iterate_phdr(
        [](dl_phdr_info* info, std::size_t /*size*/, void* result) {
          auto& code = *static_cast<Code*>(result);
          for (int i = 0; i < info->dlpi_phnum; ++i) {
            const auto& part = info->dlpi_phdr[i];
            if (part.p_type != PT_LOAD || (part.p_flags & PF_X) == 0) continue;
            const std::uintptr_t first = info->dlpi_addr + part.p_vaddr;
            code.begin = first < code.begin ? first : code.begin;
            code.end = first + part.p_memsz > code.end ? first + part.p_memsz : code.end;
          }
          return 1;  // the first object is the program
        },
        this);
  }
  bool has(const void* address) const {
    const auto at = reinterpret_cast<std::uintptr_t>(address);
    return at >= begin && at < end;
  }
};

const Code& code() {
  static const Code one;
  return one;
}

// Places that call operator new: the same where the nearest functions of the program on the stack are the same.
class Sites {
 public:
  using Key = std::uint64_t;

  static Key here() {
    std::array<void*, 64> stack{};
    const int size = backtrace(stack.data(), stack.size());
    Key key = 14695981039346656037U;
    for (int i = 0, found = 0; i < size && found < plan().stack; ++i) {
      if (!code().has(stack[static_cast<std::size_t>(i)])) continue;
      ++found;
      key = (key ^ (reinterpret_cast<std::uintptr_t>(stack[static_cast<std::size_t>(i)]) - code().begin)) *
            1099511628211U;
    }
    return key;
  }

  void note(Key key, long n) {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = key % most;; i = (i + 1) % most) {
      Site& site = sites_[i];
      if (site.first == 0) {
        if (++count_ == most) std::abort();
        site = {key, n, n};
      }
      if (site.key != key) continue;
      site.last = n;
      return;
    }
  }

  void write(int file) {
    for (const Site& site : sites_)
      if (site.first > 0) dprintf(file, "site %lx %ld %ld\n", site.key, site.first, site.last);
  }

 private:
  struct Site {
    Key key;
    long first, last;
  };
  static constexpr std::size_t most = 1 << 15;
  std::mutex mutex_;
  std::array<Site, most> sites_{};
  std::size_t count_ = 0;
};

Sites sites;

int count_file(int flags) {
  return next<int(const char*, int, mode_t)>("open")(plan().count_file, O_WRONLY | O_CREAT | flags, 0644);
}

// At once: the program may have no proper end.
void note_failure() {
  const int file = count_file(O_APPEND);
  if (file < 0) return;
  dprintf(file, "failed %lx\n", Sites::here());
  next<int(int)>("close")(file);
}

using Main = int(int, char**, char**);
Main* real_main = nullptr;
std::atomic<bool> has_begun{false};

int begin_main(int argc, char** argv, char** environment) {
  has_begun = true;
  return real_main(argc, argv, environment);
}

void* allocated(std::size_t size, const void* caller) {
  if (has_begun && code().has(caller)) {
    const long n = ++counts[new_call];
    if (is_planned(new_call, n)) {
      note_failure();
      return nullptr;
    }
    if (plan().at == 0) sites.note(Sites::here(), n);
  }
  return std::malloc(size == 0 ? 1 : size);
}

[[gnu::destructor]] void report() {
  if (plan().count_file[0] == '\0' || plan().at > 0) return;
  const int file = count_file(O_TRUNC);
  if (file < 0) return;
  for (std::size_t i = 0; i < calls; ++i) dprintf(file, "%s %ld\n", names[i], counts[i].load());
  sites.write(file);
  next<int(int)>("close")(file);
}

}  // namespace

extern "C" {

// The C library's start-up code calls this.
int __libc_start_main(Main* main, int argc, char** argv, void (*init)(), void (*fini)(), void (*at_exit)(),
                      void* stack_end) {
  real_main = main;
  return next<int(Main*, int, char**, void (*)(), void (*)(), void (*)(), void*)>("__libc_start_main")(
      begin_main, argc, argv, init, fini, at_exit, stack_end);
}

int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = mode_of(flags, rest);
  va_end(rest);
  return opened(path, flags, mode, AT_FDCWD, "open");
}
int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = mode_of(flags, rest);
  va_end(rest);
  return opened(path, flags, mode, AT_FDCWD, "open64");
}
// Relative to an open folder: counted where the name is absolute, as ours are.
int openat(int at, const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = mode_of(flags, rest);
  va_end(rest);
  return opened(path, flags, mode, at, at == AT_FDCWD ? "open" : "openat");
}
int openat64(int at, const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = mode_of(flags, rest);
  va_end(rest);
  return opened(path, flags, mode, at, at == AT_FDCWD ? "open64" : "openat64");
}
std::FILE* fopen(const char* path, const char* mode) { return opened_stream(path, mode, "fopen"); }
std::FILE* fopen64(const char* path, const char* mode) { return opened_stream(path, mode, "fopen64"); }

ssize_t read(int file, void* bytes, std::size_t size) {
  const auto real = next<ssize_t(int, void*, std::size_t)>("read");
  if (!is_tracked(file) || !fails(read_call)) return real(file, bytes, size);
  return plan().error ? fail() : real(file, bytes, size > 0 ? 1 : 0);
}

ssize_t write(int file, const void* bytes, std::size_t size) {
  const auto real = next<ssize_t(int, const void*, std::size_t)>("write");
  if (!is_tracked(file) || !fails(write_call)) return real(file, bytes, size);
  return plan().error ? fail() : real(file, bytes, size > 0 ? 1 : 0);
}
ssize_t pwrite(int file, const void* bytes, std::size_t size, off_t offset) {
  const auto real = next<ssize_t(int, const void*, std::size_t, off_t)>("pwrite");
  if (!is_tracked(file) || !fails(write_call)) return real(file, bytes, size, offset);
  return plan().error ? fail() : real(file, bytes, size > 0 ? 1 : 0, offset);
}
ssize_t writev(int file, const iovec* parts, int parts_count) {
  if (!is_tracked(file) || !fails(write_call))
    return next<ssize_t(int, const iovec*, int)>("writev")(file, parts, parts_count);
  if (plan().error) return fail();
  for (int i = 0; i < parts_count; ++i)
    if (parts[i].iov_len > 0) return next<ssize_t(int, const void*, std::size_t)>("write")(file, parts[i].iov_base, 1);
  return 0;
}

int fsync(int file) { return is_tracked(file) && fails(fsync_call) ? fail() : next<int(int)>("fsync")(file); }
int syncfs(int file) noexcept {
  return is_tracked(file) && fails(fsync_call) ? fail() : next<int(int)>("syncfs")(file);
}

int rename(const char* from, const char* to) noexcept {
  return is_in_folder(to) && fails(rename_call) ? fail() : next<int(const char*, const char*)>("rename")(from, to);
}

// As in Linux: closed even where it fails.
int close(int file) {
  const bool is_ours = is_tracked(file);
  if (is_ours) is_open[static_cast<std::size_t>(file)] = false;
  const int result = next<int(int)>("close")(file);
  return is_ours && fails(close_call) ? fail() : result;
}

int mkdir(const char* path, mode_t mode) noexcept {
  return is_in_folder(path) && fails(mkdir_call) ? fail() : next<int(const char*, mode_t)>("mkdir")(path, mode);
}

}  // extern "C"

void* operator new(std::size_t size) {
  void* memory = allocated(size, __builtin_return_address(0));
  if (!memory) throw std::bad_alloc();
  return memory;
}
void* operator new[](std::size_t size) {
  void* memory = allocated(size, __builtin_return_address(0));
  if (!memory) throw std::bad_alloc();
  return memory;
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
