#include "runtime/scene/mesh/mesh_text.h"

#include <algorithm>

namespace itn {
namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f' || c == '\v'; }

}  // namespace

std::string_view TextCursor::next_line() {
  if (at_line_start_) ++line_;
  at_line_start_ = true;
  const std::size_t end = std::min(text_.find('\n', position_), text_.size());
  std::string_view line = text_.substr(position_, end - position_);
  position_ = std::min(end + 1, text_.size());
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::string_view TextCursor::next_word() {
  if (at_line_start_) ++line_;
  at_line_start_ = false;
  while (position_ < text_.size() && is_space(text_[position_])) {
    if (text_[position_] == '\n') ++line_;
    ++position_;
  }
  const std::size_t begin = position_;
  while (position_ < text_.size() && !is_space(text_[position_])) ++position_;
  return text_.substr(begin, position_ - begin);
}

std::string_view take_word(std::string_view& line) {
  while (!line.empty() && is_space(line.front())) line.remove_prefix(1);
  std::size_t end = 0;
  while (end < line.size() && !is_space(line[end])) ++end;
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(end);
  return word;
}

}  // namespace itn
