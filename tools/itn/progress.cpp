#include "tools/itn/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace itn::tools {
namespace {

std::string with_prefix(double value) {
  for (const auto& [factor, prefix] : {std::pair{1e9, "G"}, {1e6, "M"}, {1e3, "k"}})
    if (value >= factor) return fmt::format("{:.3g} {}", value / factor, prefix);
  return fmt::format("{:.3g} ", value);
}

std::string duration(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace

Progress::Progress(std::string label, double amount, std::string unit, bool wanted, double done)
    : label_(std::move(label)),
      unit_(std::move(unit)),
      amount_(amount),
      done_(done),
      shown_(wanted && isatty(STDERR_FILENO)) {}

void Progress::clear() {
  if (shown_ && last_ != Clock::time_point{}) std::fputs("\r\033[K", stderr);
}

void Progress::update(double fraction) {
  const Clock::time_point now = Clock::now();
  if (!shown_ || fraction <= done_ || now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  const double per_second = (fraction - done_) / std::chrono::duration<double>(now - start_).count();
  const std::string line = fmt::format("\r\033[K{}  {:3.0f} %  {}{}/s  {} left", label_, 100 * fraction,
                                       with_prefix(amount_ * per_second), unit_, duration((1 - fraction) / per_second));
  std::fputs(line.c_str(), stderr);
  std::fflush(stderr);
}

}  // namespace itn::tools
