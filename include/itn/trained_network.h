// The network that a training (training_run.h) left in its folder, RUN, for whoever uses it.
#pragma once
#include <string>

#include "itn/network.h"

namespace itn {

// The names of the networks that ship with the program where a RUN is asked for (include/itn/shipped.h).
constexpr const char* shipped_run = "shipped";
constexpr const char* shipped_photos_run = "shipped-photos";
constexpr const char* shipped_photos_judge = "shipped-photos-judge";

// The network of a RUN: RUN/network.safetensors, a file as it is, or a shipped one. Throws InputError: there is none,
// or it cannot be read.
Network network_of(const std::string& run);

// Tells the networks of runs apart: 16 hexadecimal digits. Throws InputError: there is none.
std::string network_fingerprint(const std::string& run);

}  // namespace itn
