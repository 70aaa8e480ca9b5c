#include "python/src/running.h"

#include <signal.h>  // NOLINT(modernize-deprecated-headers): sigaction is POSIX

namespace itn::python {
namespace {

// The call of the main thread, where Python's signal handlers run.
std::atomic<Running*> call_of_main{nullptr};
struct sigaction before {};

// Python's own handler only takes a note, which is looked at when the call has ended.
void on_interrupt(int number) {
  if (Running* call = call_of_main) call->stop();
  if ((before.sa_flags & SA_SIGINFO) == 0 && before.sa_handler != SIG_DFL && before.sa_handler != SIG_IGN)
    before.sa_handler(number);
}

bool is_main_thread() {
  const nb::module_ threading = nb::module_::import_("threading");
  return threading.attr("current_thread")().is(threading.attr("main_thread")());
}

}  // namespace

Running::Running(nb::object progress)
    : progress_(std::move(progress)), in_main_thread_(call_of_main == nullptr && is_main_thread()) {
  if (!in_main_thread_) return;
  sigaction(SIGINT, nullptr, &before);
  if (before.sa_handler == SIG_DFL || before.sa_handler == SIG_IGN) {  // not Python's: whoever set it wants that
    in_main_thread_ = false;
    return;
  }
  call_of_main = this;
  struct sigaction action = before;
  action.sa_handler = on_interrupt;
  action.sa_flags = before.sa_flags & ~SA_SIGINFO;
  sigaction(SIGINT, &action, nullptr);
}

Running::~Running() {
  if (!in_main_thread_) return;
  sigaction(SIGINT, &before, nullptr);
  call_of_main = nullptr;
}

void Running::stop() {
  cancel_ = true;
  if (std::atomic<bool>* other = other_) *other = true;
}

void Running::update(double fraction) {
  const auto now = std::chrono::steady_clock::now();
  if (progress_.is_none() || error_ || (fraction < 1 && now - last_ < std::chrono::milliseconds(100))) return;
  last_ = now;
  const nb::gil_scoped_acquire acquire;
  try {
    progress_(fraction);
  } catch (...) {
    error_ = std::current_exception();
    stop();
  }
}

void Running::raise_python_error() {
  if (error_) std::rethrow_exception(error_);
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

}  // namespace itn::python
