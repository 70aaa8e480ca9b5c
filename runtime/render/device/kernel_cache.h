// The folder in which PoCL keeps the programs that it has compiled.
#pragma once
#include <string>

namespace itn {

// As PoCL chooses it: POCL_CACHE_DIR, XDG_CACHE_HOME, HOME, and where none is set /tmp.
std::string kernel_cache_folder();

// Reason why the folder cannot be used, and what to do about it; empty where it can: PoCL offers no device without it.
std::string kernel_cache_fault();

}  // namespace itn
