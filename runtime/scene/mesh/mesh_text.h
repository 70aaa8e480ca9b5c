// Reading numbers and words from a mesh file in memory, with a place to name in messages.
#pragma once
#include <charconv>
#include <string>
#include <string_view>

#include "itn/error.h"

namespace itn {

// Steps through text line by line and word by word.
class TextCursor {
 public:
  TextCursor(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

  bool at_end() const { return position_ >= text_.size(); }
  std::size_t position() const { return position_; }
  // The next line without its end; the cursor then stands on the line after it.
  std::string_view next_line();
  // The next word anywhere (across lines); empty at the end.
  std::string_view next_word();

  // "file:line"
  std::string where() const { return file_ + ":" + std::to_string(line_); }
  [[noreturn]] void fail(const std::string& what) const { throw InputError(where() + ": " + what); }

 private:
  std::string_view text_;
  std::string file_;
  std::size_t position_ = 0;
  long line_ = 0;              // of what was read last
  bool at_line_start_ = true;  // has the line after line_ begun?
};

// Takes the first word off `line`; empty when there is none.
std::string_view take_word(std::string_view& line);

// The whole word as a number.
template <class Number>
bool parse_whole(std::string_view word, Number& out) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), out);
  return error == std::errc() && stop == word.data() + word.size();
}

}  // namespace itn
