#include "runtime/scene/xml/message.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <numeric>

namespace itn {

std::string to_string(const Location& where) {
  return where.file + ":" + std::to_string(where.line) + ":" + std::to_string(where.column);
}

void fail(const Location& where, const std::string& what) { throw LocatedError(where, to_string(where) + ": " + what); }

std::string quote(const std::string& text) { return '"' + text + '"'; }

std::string list_of(const std::vector<std::string>& names) {
  if (names.empty()) return "nothing";
  std::string out = quote(names[0]);
  for (std::size_t i = 1; i < names.size(); ++i) out += (i + 1 < names.size() ? ", " : " or ") + quote(names[i]);
  return out;
}

std::string to_text(double value) {
  char buffer[32];
  return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

namespace {

// Levenshtein distance.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string suggestion(const std::string& name, const std::vector<std::string>& allowed) {
  if (name.size() > 100) return "";
  std::size_t best = name.size() / 3 + 2;
  std::string nearest;
  for (const std::string& candidate : allowed) {
    const std::size_t distance = edit_distance(name, candidate);
    if (distance < best) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest.empty() ? "" : "; did you mean " + quote(nearest) + "?";
}

std::string need_one_of(const std::string& name, const std::vector<std::string>& allowed) {
  constexpr std::size_t most = 60;
  if (allowed.size() <= most) return "; need " + list_of(allowed) + suggestion(name, allowed);
  const std::vector<std::string> first(allowed.begin(), allowed.begin() + most);
  return fmt::format("; need {}, or one of {} others", list_of(first), allowed.size() - most) +
         suggestion(name, allowed);
}

}  // namespace itn
