#include "tools/interrupt.h"

#include <fcntl.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): sigaction is POSIX
#include <sys/time.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <exception>
#include <new>

#include "runtime/base/file.h"
#include "runtime/device/kernel_cache.h"

namespace itn::tools {
namespace {

std::atomic<bool> interrupted{false}, orderly{false};
static_assert(std::atomic<bool>::is_always_lock_free, "signal handlers may use lock-free atomics only");

const char* end_text = "interrupted\n";

// Everything here must be safe in a signal handler.
[[noreturn]] void end_with(int code, const char* text) {
  remove_unfinished_file();
  const auto ignored = write(STDERR_FILENO, text, std::strlen(text));
  (void)ignored;
  _exit(code);
}

void end_now(int) { end_with(130, end_text); }

void on_signal(int signal_number) {
  if (interrupted.exchange(true)) end_now(signal_number);
  if (orderly) return;
  const itimerval in_a_moment{{0, 0}, {0, 500000}};
  setitimer(ITIMER_REAL, &in_a_moment, nullptr);
}

char abort_text[4096];

// A driver that aborts: PoCL does where a file in its cache is damaged. Only what a signal handler may do.
[[noreturn]] void on_abort(int) {
  constexpr int device_failure = 4;
  end_with(device_failure, abort_text);
}

// An exception where none may pass: memory that ends while JSON is destroyed, for instance.
[[noreturn]] void on_terminate() {
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    constexpr int failed = 1;
    end_with(failed, "itn: out of memory on the host; use a smaller mesh or image\n");
  } catch (...) {  // which is no reason to go on
  }
  on_abort(SIGABRT);
}

void handle(int signal_number, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigaction(signal_number, &action, nullptr);
}

}  // namespace

// In place of the C library's: PoCL asserts where a file in its cache is cut off, and by then LLVM, which it brings,
// has taken SIGABRT's handler away. The linker exports it (CMakeLists.txt).
extern "C" [[noreturn]] void __assert_fail(const char* assertion, const char* file, unsigned line,  // NOLINT
                                           const char* function) noexcept {
  std::fprintf(stderr, "itn: %s:%u: %s: assertion failed: %s\n", file, line, function, assertion);
  on_abort(SIGABRT);
}

const std::atomic<bool>& interrupt_flag() { return interrupted; }

void open_standard_files() {
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(number, F_GETFD) >= 0) continue;
    // The lowest number that is free. Reading from the first, or writing to the others, goes on failing.
    const int opened = open("/dev/null", number == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    (void)opened;
  }
}

void watch_for_interrupt() {
  std::snprintf(
      abort_text, sizeof abort_text,
      "itn: the OpenCL driver, or a library, has given up; if it does so again, remove the folder of compiled "
      "programs: rm -r %s\n",
      kernel_cache_folder().c_str());
  std::set_terminate(on_terminate);
  handle(SIGABRT, on_abort);
  handle(SIGBUS, on_abort);  // a file of the cache that is cut off
  handle(SIGALRM, end_now);
  handle(SIGINT, on_signal);
  handle(SIGTERM, on_signal);
  // A terminal that is closed, unless the caller (nohup) wants the program to go on.
  struct sigaction hangup {};
  if (sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler == SIG_DFL) handle(SIGHUP, on_signal);
  // A reader that is gone: writing fails, and is reported; what takes long is stored first.
  handle(SIGPIPE, SIG_IGN);
}

void say_when_ended(const char* text) { end_text = text; }

OrderlyEnd::OrderlyEnd() { orderly = true; }

OrderlyEnd::~OrderlyEnd() { orderly = false; }

}  // namespace itn::tools
