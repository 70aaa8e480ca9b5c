// The network that ships with the program (weights/README.md: what it has learnt, and how well).
#pragma once
#include <string_view>

namespace itn {

// The bytes of its file, for parse_network().
std::string_view shipped_network();

}  // namespace itn
