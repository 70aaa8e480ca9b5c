// The networks that ship with the program (weights/README.md: what they have learnt, and how well).
#pragma once
#include <string_view>

namespace itn {

// The bytes of their files, for parse_network(): of the one that knows shape and light, and of the one that sees a
// photo, the same with a flash, and a mask, with its judge (training/judge.h).
std::string_view shipped_network();
std::string_view shipped_photo_network();
std::string_view shipped_photo_judge();

}  // namespace itn
