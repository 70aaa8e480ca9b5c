#include "runtime/scene/xml/report.h"

#include <algorithm>
#include <tuple>

#include "runtime/base/input_errors.h"
#include "runtime/base/printable.h"

namespace itn {
namespace {

constexpr std::size_t most_told = 200;     // of problems: the rest is counted
constexpr std::size_t most_kept = 10'000;  // of all messages: hostile files have millions

}  // namespace

void Report::add(const Location& where, const std::string& what) { add_message(where, to_string(where) + ": " + what); }

void Report::add_message(const Location& where, const std::string& message) {
  if (told_.size() < most_kept && told_.insert(message).second) problems_.push_back({where, message});
}

void Report::warn(const Location& where, const std::string& what) {
  const std::string message = to_string(where) + ": " + what;
  if (told_.size() < most_kept && told_.insert(message).second) warnings_.push_back(message);
}

bool Report::is_full() const { return problems_.size() > most_told; }

void Report::raise() const {
  if (problems_.empty()) return;
  std::vector<std::string> files;  // in the order in which their first problem was found
  const auto rank = [&](const Problem& problem) {
    const auto found = std::find(files.begin(), files.end(), problem.where.file);
    return std::tuple(found - files.begin(), problem.where.line, problem.where.column);
  };
  for (const Problem& problem : problems_)
    if (std::find(files.begin(), files.end(), problem.where.file) == files.end()) files.push_back(problem.where.file);
  std::vector<Problem> sorted = problems_;
  std::stable_sort(sorted.begin(), sorted.end(), [&](const Problem& a, const Problem& b) { return rank(a) < rank(b); });
  std::string text;
  for (std::size_t i = 0; i < std::min(sorted.size(), most_told); ++i)
    text += (i ? "\n" : "") + printable(sorted[i].message);
  if (sorted.size() > most_told) text += "\nand " + std::to_string(sorted.size() - most_told) + " more";
  throw InputErrors(text);
}

}  // namespace itn
