// Text from files, for a terminal.
#pragma once
#include <string>
#include <string_view>

namespace itn {

// Is it whole UTF-8?
bool is_utf8(std::string_view text);

// One line: control characters (they could move a terminal's cursor or worse), characters that change the writing
// direction and bytes that are not UTF-8 become \x1b and the like, ends of lines \n. Text longer than `most` bytes
// loses its middle.
std::string printable(std::string_view text, std::size_t most = 4000);

// The same for a message of several lines: their ends stay.
std::string printable_lines(std::string_view text, std::size_t most = 4000);

}  // namespace itn
