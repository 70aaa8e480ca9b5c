// Limits that the shell sets (ulimit): what fails for them fails far from where they are.
#pragma once
#include <string>

namespace itn {

// For the end of a message, "; the shell's limits may be why: ulimit -v 204800 ..."; empty: none that could be.
std::string limits_in_force();

}  // namespace itn
