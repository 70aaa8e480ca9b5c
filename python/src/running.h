// A long call into the libraries: without the interpreter's lock, stopped by Ctrl-C, with progress.
#pragma once
#include <nanobind/nanobind.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <utility>

namespace itn::python {

namespace nb = nanobind;

class Running {
 public:
  // progress: a callable that is told the fraction done now and then, or None. While one lives in the main thread,
  // Ctrl-C sets the flag, too. With the interpreter's lock.
  explicit Running(nb::object progress);
  ~Running();
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  const std::atomic<bool>& cancel() const { return cancel_; }
  // A flag of somebody who lives longer, to be set at the same time; null: no longer.
  void also_cancel(std::atomic<bool>* other) { other_ = other; }
  // Safe in a signal handler.
  void stop();
  // Without the interpreter's lock. An exception of the callable ends the call.
  void update(double fraction);
  // With it: throws what Ctrl-C or the callable asks for, where that was the reason.
  void raise_python_error();

 private:
  nb::object progress_;
  std::atomic<bool> cancel_{false};
  std::atomic<std::atomic<bool>*> other_{nullptr};
  std::exception_ptr error_;
  std::chrono::steady_clock::time_point last_{};
  bool in_main_thread_;
};

// job(running), as above. Of what it holds nothing may be a Python object.
template <class Job>
auto interruptible(nb::object progress, const Job& job) {
  Running running(std::move(progress));
  try {
    const nb::gil_scoped_release release;
    return job(running);
  } catch (...) {
    running.raise_python_error();
    throw;
  }
}

}  // namespace itn::python
