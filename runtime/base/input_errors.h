#pragma once
#include "itn/error.h"

namespace itn {

// All that is wrong with a file. The message has a line for each problem, printable.
struct InputErrors : InputError {
  using InputError::InputError;
};

}  // namespace itn
