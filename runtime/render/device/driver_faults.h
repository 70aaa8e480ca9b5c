// Why an installed OpenCL driver offers no device: the loader leaves out what it cannot load, without a word.
#pragma once
#include <string>

namespace itn {

// For where there is no device at all: what a driver that is installed lacks, or which limit of the shell may keep it
// away, or that none is installed, and what to do.
std::string no_device_reason();

}  // namespace itn
