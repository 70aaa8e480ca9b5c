// Text from files, for a terminal.
#pragma once
#include <string>
#include <string_view>

namespace itn {

// Is it whole UTF-8?
bool is_utf8(std::string_view text);

// Control characters, which could move a terminal's cursor or worse, and bytes that are no UTF-8 become \x1b and the
// like; line ends stay. What is longer than `most` bytes loses its middle.
std::string printable(std::string_view text, std::size_t most = 4000);

}  // namespace itn
