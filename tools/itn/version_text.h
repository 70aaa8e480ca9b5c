// The text of `itn --version`.
#pragma once
#include <string>

namespace itn::tools {

// The version alone in the first line; then devices, and the libraries that the program was built with.
std::string version_text();

}  // namespace itn::tools
