#include "tools/itn/interrupt.h"

#include <fcntl.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): sigaction is POSIX
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <system_error>

#include "itn/file.h"
#include "runtime/base/limits.h"
#include "runtime/render/device/kernel_cache.h"
#include "tools/itn/hold_signals.h"

// The C library's own name of sigaction(), whose other one is below.
extern "C" int __sigaction(int, const struct sigaction*, struct sigaction*) noexcept;  // NOLINT

namespace itn::tools {
namespace {

constexpr int failed_code = 1, device_failure_code = 4, interrupted_code = 130;

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

void end_now(int) { end_with(interrupted_code, end_text); }

void handle(int signal_number, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  __sigaction(signal_number, &action, nullptr);
}

void on_signal(int signal_number) {
  if (interrupted.exchange(true)) end_now(signal_number);
  if (orderly) return;
  const itimerval in_a_moment{{0, 0}, {0, 500000}};
  setitimer(ITIMER_REAL, &in_a_moment, nullptr);
}

// As the system does by itself, with a core file where there is one, but for the unfinished output file.
void end_by(int signal_number) {
  remove_unfinished_file();
  handle(signal_number, SIG_DFL);
  raise(signal_number);
}

void on_time_limit(int) {
  end_with(failed_code,
           "itn: the processor time that the shell allows is used up (ulimit -t); raise it; what has been stored is "
           "there, and commands that go on from it will\n");
}

char abort_text[4096];

// A driver that aborts: PoCL does where a file in its cache is damaged. Only what a signal handler may do.
[[noreturn]] void on_abort(int) { end_with(device_failure_code, abort_text); }

char fault_text[512];

// A library that uses memory which it asked for and did not get, as oneDNN does.
[[noreturn]] void on_fault(int) { end_with(failed_code, fault_text); }

bool is_limited(__rlimit_resource resource) {
  rlimit limit{};
  return getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
}

std::atomic<bool> keeps_handlers{false}, keeps_fault{false};

// An exception where none may pass: memory that ends while JSON is destroyed, for instance, or a thread that a library
// cannot start before main().
[[noreturn]] void on_terminate() {
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    end_with(failed_code, "itn: out of memory on the host; use a smaller mesh or image, or a larger ulimit -v\n");
  } catch (const std::system_error&) {
    end_with(
        failed_code,
        "itn: the system refuses a thread, memory or a file; the limits of the shell (ulimit -a) may be too low\n");
  } catch (...) {  // which is no reason to go on
  }
  on_abort(SIGABRT);
}

// A limit that is the last one comes as SIGKILL: the first is set to a second before.
void leave_time_to_say_so() {
  rlimit limit{};
  if (getrlimit(RLIMIT_CPU, &limit) != 0 || limit.rlim_max == RLIM_INFINITY) return;
  const rlim_t before = std::max<rlim_t>(limit.rlim_max, 2) - 1;
  if (before == limit.rlim_max) {  // whole seconds: there is none before the first
    constexpr itimerval nearly{{0, 0}, {0, 800000}};
    setitimer(ITIMER_PROF, &nearly, nullptr);
  }
  limit.rlim_cur = std::min(limit.rlim_cur, before);
  setrlimit(RLIMIT_CPU, &limit);
}

constexpr std::array asks_to_end{SIGINT, SIGTERM, SIGHUP};

// A terminal that is closed ends the program, unless the caller (nohup) wants it to go on.
bool is_wanted(int signal_number) {
  struct sigaction before {};
  return signal_number != SIGHUP || (__sigaction(signal_number, nullptr, &before) == 0 && before.sa_handler != SIG_IGN);
}

void set_handlers(void (*on_end)(int)) {
  for (const int signal_number : asks_to_end)
    if (is_wanted(signal_number)) handle(signal_number, on_end);
  handle(SIGALRM, end_now);
  for (const int signal_number : {SIGQUIT, SIGUSR1, SIGUSR2}) handle(signal_number, end_by);
  for (const int signal_number : {SIGXCPU, SIGPROF}) handle(signal_number, on_time_limit);
  // Writing fails, and is reported: files that become too large, readers that are gone. What takes long is stored
  // first.
  handle(SIGXFSZ, SIG_IGN);
  handle(SIGPIPE, SIG_IGN);
}

// Loading the libraries' data takes a tenth of a second, in which nothing is begun.
void begin_handling(int /*argc*/, char** /*argv*/, char** /*environment*/) {
  std::snprintf(abort_text, sizeof abort_text, "itn: a library has given up before anything was begun\n");
  std::set_terminate(on_terminate);
  set_handlers(end_now);
  sigset_t all;
  sigemptyset(&all);
  for (const int signal_number : asks_to_end) sigaddset(&all, signal_number);
  sigprocmask(SIG_UNBLOCK, &all, nullptr);  // hold_signals()
  leave_time_to_say_so();
}

// Called before the constructors of the libraries that the program is linked with.
__attribute__((section(".preinit_array"), used)) void (*const before_libraries)(int, char**, char**) = begin_handling;

}  // namespace

// In place of the C library's: PoCL asserts where a file in its cache is cut off, and by then LLVM, which it brings,
// has taken SIGABRT's handler away. The linker exports it (CMakeLists.txt).
extern "C" [[noreturn]] void __assert_fail(const char* assertion, const char* file, unsigned line,  // NOLINT
                                           const char* function) noexcept {
  std::fprintf(stderr, "itn: %s:%u: %s: assertion failed: %s\n", file, line, function, assertion);
  on_abort(SIGABRT);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// In place of the C library's: LLVM takes a dozen signals when it first compiles, and then swallows SIGQUIT and
// SIGUSR1. What the program has set stays; the caller is told that it was changed.
extern "C" int sigaction(int signal_number, const struct sigaction* action,  // NOLINT
                         struct sigaction* before) noexcept {
  constexpr std::array kept{SIGABRT, SIGALRM, SIGPROF, SIGBUS,  SIGHUP,  SIGINT, SIGPIPE,
                            SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2, SIGXCPU, SIGXFSZ};
  const bool keep = (keeps_handlers && std::find(kept.begin(), kept.end(), signal_number) != kept.end()) ||
                    (keeps_fault && signal_number == SIGSEGV);
  return __sigaction(signal_number, keep ? nullptr : action, before);
}
#endif

const std::atomic<bool>& interrupt_flag() { return interrupted; }

void open_standard_files() {
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(number, F_GETFD) >= 0) continue;
    // The lowest number that is free. Reading from the first, or writing to the others, goes on failing.
    const int opened = open("/dev/null", number == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    (void)opened;
  }
}

void hold_signals() {
  sigset_t all;
  sigemptyset(&all);
  for (const int signal_number : asks_to_end) sigaddset(&all, signal_number);
  sigprocmask(SIG_BLOCK, &all, nullptr);
}

void watch_for_interrupt() {
  std::snprintf(
      abort_text, sizeof abort_text,
      "itn: the OpenCL driver, or a library, has given up%s; if it does so again, remove the folder of compiled "
      "programs: rm -r %s\n",
      limits_in_force().c_str(), kernel_cache_folder().c_str());
  std::set_terminate(on_terminate);
  handle(SIGABRT, on_abort);
  handle(SIGBUS, on_abort);  // a file of the cache that is cut off
  // Without such a limit a fault is the program's own, and ends it as faults do.
  if (is_limited(RLIMIT_AS) || is_limited(RLIMIT_DATA)) {
    std::snprintf(fault_text, sizeof fault_text, "itn: a library uses memory that it did not get (SIGSEGV)%s\n",
                  limits_in_force().c_str());
    handle(SIGSEGV, on_fault);
    keeps_fault = true;
  }
  set_handlers(on_signal);
  keeps_handlers = true;
}

void say_when_ended(const char* text) { end_text = text; }

OrderlyEnd::OrderlyEnd() { orderly = true; }

OrderlyEnd::~OrderlyEnd() { orderly = false; }

}  // namespace itn::tools
