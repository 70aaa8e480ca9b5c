#include "runtime/base/printable.h"

#include <fmt/format.h>

#include <algorithm>

namespace itn {
namespace {

// Bytes of the character at the beginning; 0: none in UTF-8.
std::size_t character_size(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t size = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < size) return 0;
  for (std::size_t i = 1; i < size; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  // Written longer than needed, halves of pairs, beyond the last character.
  if ((first == 0xe0 && byte(1) < 0xa0) || (first == 0xed && byte(1) > 0x9f) || (first == 0xf0 && byte(1) < 0x90) ||
      (first == 0xf4 && byte(1) > 0x8f))
    return 0;
  return size;
}

bool is_control(std::string_view character) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(character[i]); };
  if (character.size() == 1) return byte(0) < ' ' || byte(0) == 0x7f;
  return character.size() == 2 && byte(0) == 0xc2 && byte(1) < 0xa0;  // the second set of them, from 0x80
}

// Characters that change the writing direction, so that a message would seem to say something else: U+061C, U+200E and
// U+200F, U+202A to U+202E, U+2066 to U+2069.
bool turns_text(std::string_view character) {
  return character == "\u061c" || character == "\u200e" || character == "\u200f" ||
         (character >= "\u202a" && character <= "\u202e") || (character >= "\u2066" && character <= "\u2069");
}

enum class LineEnds { stay, are_written };

std::string escaped(std::string_view text, LineEnds line_ends) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t size = character_size(text);
    const std::string_view character = text.substr(0, std::max<std::size_t>(size, 1));
    if (character == "\n")
      out += line_ends == LineEnds::stay ? "\n" : "\\n";
    else if (size == 0 || is_control(character) || turns_text(character))
      for (const char c : character) out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    else
      out += character;
    text.remove_prefix(character.size());
  }
  return out;
}

std::string shortened(std::string_view text, std::size_t most, LineEnds line_ends) {
  if (text.size() <= most) return escaped(text, line_ends);
  // A message's beginning says where the error is, its end what to do: the middle goes. Cut between characters.
  std::size_t begin = most * 3 / 4, end = text.size() - most / 4;
  const auto is_inside = [&](std::size_t at) { return (static_cast<unsigned char>(text[at]) & 0xc0) == 0x80; };
  for (int i = 0; i < 3 && is_inside(begin); ++i) --begin;
  for (int i = 0; i < 3 && end < text.size() && is_inside(end); ++i) ++end;
  return fmt::format("{} ... ({} bytes left out) ... {}", escaped(text.substr(0, begin), line_ends), end - begin,
                     escaped(text.substr(end), line_ends));
}

}  // namespace

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t size = character_size(text);
    if (size == 0) return false;
    text.remove_prefix(size);
  }
  return true;
}

std::string printable(std::string_view text, std::size_t most) { return shortened(text, most, LineEnds::are_written); }

std::string printable_lines(std::string_view text, std::size_t most) { return shortened(text, most, LineEnds::stay); }

}  // namespace itn
