#include "runtime/scene/xml/values.h"

#include <cctype>
#include <charconv>
#include <cmath>

#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

std::string trim(const std::string& text) {
  const char* space = " \t\r\n";
  const std::size_t first = text.find_first_not_of(space);
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(space) - first + 1);
}

// The whole of `text` as T. from_chars knows no locale and no leading '+'.
template <class T>
bool convert(const std::string& text, T& out) {
  const char* begin = text.data() + (text.size() > 1 && text[0] == '+' && text[1] != '-' ? 1 : 0);
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(begin, end, out);
  return error == std::errc() && stop == end && begin != end;
}

}  // namespace

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

double parse_number(const std::string& text, const Location& where, const std::string& what) {
  double out = 0;
  if (!convert(trim(text), out)) fail(where, what + ": got " + quote(text) + ", need a number");
  constexpr double greatest = 1e30;  // products of two stay within single precision only where the other is small
  if (!(std::abs(out) <= greatest))
    fail(where, what + ": got " + quote(text) + ", need a finite number of at most 1e30, for single precision");
  return out;
}

long parse_integer(const std::string& text, const Location& where, const std::string& what) {
  long out = 0;
  if (!convert(trim(text), out)) fail(where, what + ": got " + quote(text) + ", need an integer");
  return out;
}

bool parse_boolean(const std::string& text, const Location& where, const std::string& what) {
  const std::string word = lower_case(trim(text));
  if (word == "true") return true;
  if (word == "false") return false;
  fail(where, what + ": got " + quote(text) + ", need \"true\" or \"false\"");
}

std::vector<double> parse_numbers(const std::string& text, const Location& where, const std::string& what) {
  std::vector<double> out;
  const char* separators = " ,\t\r\n";
  std::size_t begin = text.find_first_not_of(separators);
  while (begin != std::string::npos) {
    const std::size_t end = text.find_first_of(separators, begin);
    out.push_back(parse_number(text.substr(begin, end - begin), where, what));
    begin = end == std::string::npos ? end : text.find_first_not_of(separators, end);
  }
  if (out.empty()) fail(where, what + ": got " + quote(text) + ", need numbers");
  return out;
}

}  // namespace itn
