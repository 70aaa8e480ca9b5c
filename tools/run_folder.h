// The folder that `itn train` leaves, RUN, for whoever uses its network.
#pragma once
#include <string>

namespace itn::tools {

// RUN/network.safetensors; a file is taken as it is. Throws InputError: there is none.
std::string network_file_of(const std::string& run);

}  // namespace itn::tools
