#include "tools/interrupt.h"

#include <signal.h>  // NOLINT(modernize-deprecated-headers): sigaction is POSIX
#include <sys/time.h>
#include <unistd.h>

#include "runtime/base/file.h"

namespace itn::tools {
namespace {

std::atomic<bool> interrupted{false}, orderly{false};
static_assert(std::atomic<bool>::is_always_lock_free, "signal handlers may use lock-free atomics only");

// Everything here must be safe in a signal handler.
void end_now(int) {
  remove_unfinished_file();
  constexpr char text[] = "interrupted\n";
  const auto ignored = write(STDERR_FILENO, text, sizeof text - 1);
  (void)ignored;
  _exit(130);
}

void on_signal(int signal_number) {
  if (interrupted.exchange(true)) end_now(signal_number);
  if (orderly) return;
  const itimerval in_a_moment{{0, 0}, {0, 500000}};
  setitimer(ITIMER_REAL, &in_a_moment, nullptr);
}

void handle(int signal_number, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigaction(signal_number, &action, nullptr);
}

}  // namespace

const std::atomic<bool>& interrupt_flag() { return interrupted; }

void watch_for_interrupt() {
  handle(SIGALRM, end_now);
  handle(SIGINT, on_signal);
  handle(SIGTERM, on_signal);
}

OrderlyEnd::OrderlyEnd() { orderly = true; }

OrderlyEnd::~OrderlyEnd() { orderly = false; }

}  // namespace itn::tools
