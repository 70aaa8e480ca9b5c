#include "runtime/image/bitmap_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstddef>

#include "itn/error.h"

namespace itn {
namespace {

unsigned byte_at(const std::string& bytes, std::size_t at) {
  return at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : 0;
}

}  // namespace

void check_runs_of_hdr(const std::string& bytes, int width, int height, const std::string& path) {
  constexpr int least = 8, most = 32767;  // others have no runs
  if (width < least || width > most) return;
  const std::size_t empty_line = bytes.find("\n\n");
  std::size_t at = empty_line == std::string::npos ? empty_line : bytes.find('\n', empty_line + 2);
  if (at == std::string::npos) return;
  ++at;
  for (int row = 0; row < height; ++row) {
    const bool has_runs = byte_at(bytes, at) == 2 && byte_at(bytes, at + 1) == 2 && byte_at(bytes, at + 2) < 0x80;
    if (!has_runs && row > 0)
      throw InputError(
          fmt::format("{}: image is damaged; row {} at byte {} has no runs, and those before have: copy "
                      "or save it again",
                      path, row, at));
    if (!has_runs) return;
    at += 4;
    for (int channel = 0; channel < 4; ++channel)
      for (int done = 0; done < width;) {
        const auto count = static_cast<int>(byte_at(bytes, at++));
        constexpr int run = 128;  // more: so many times the next byte; else so many bytes
        if (count == 0)
          throw InputError(fmt::format("{}: image is damaged; byte {}: ends, or a run of no pixels", path, at - 1));
        done += count > run ? count - run : count;
        at += count > run ? 1 : static_cast<std::size_t>(count);
      }
  }
}

bool is_pnm(const std::string& bytes) { return bytes.starts_with("P5") || bytes.starts_with("P6"); }

int largest_of_pnm(const std::string& bytes, const std::string& path) {
  constexpr int numbers = 3;  // width, height, the largest value
  constexpr std::size_t most_digits = 9;
  std::size_t at = 2;
  int number = 0;
  for (int i = 0; i < numbers; ++i) {
    at = std::min(bytes.find_first_not_of(" \t\n\v\f\r", at), bytes.size());
    while (at < bytes.size() && bytes[at] == '#') {
      at = std::min(bytes.find_first_of("\r\n", at), bytes.size());
      at = std::min(bytes.find_first_not_of(" \t\n\v\f\r", at), bytes.size());
    }
    const std::size_t end = std::min(bytes.find_first_not_of("0123456789", at), bytes.size());
    if (end - at > most_digits)
      throw InputError(fmt::format("{}: image is damaged; byte {}: a number of {} digits", path, at, end - at));
    number = 0;
    std::from_chars(bytes.data() + at, bytes.data() + end, number);
    at = end;
  }
  if (number == 0) throw InputError(path + ": image is damaged; its largest value is missing or 0");
  return number;
}

}  // namespace itn
