// The errors with which a command fails, one type for each exit code (see tools/itn/main.cpp).
#pragma once
#include <stdexcept>
#include <string>

namespace itn {

// A file that was read is wrong: exit code 3. The message says where, what, what was expected and what to do.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// OpenCL or device failure: exit code 4.
struct DeviceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Ctrl-C: exit code 130.
struct Interrupted : std::runtime_error {
  Interrupted() : std::runtime_error("interrupted") {}
};

// Wrong option or value on the command line: exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Anything that fails after good input: output folder not writable, disk full. Exit code 1.
struct ResultError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace itn
