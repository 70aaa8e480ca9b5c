#include "runtime/image/bitmap_check.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "runtime/base/error.h"

namespace itn {
namespace {

unsigned byte_at(const std::string& bytes, std::size_t at) {
  return at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : 0;
}

// From the byte behind the marker of a segment of tables on.
void check_huffman_tables(const std::string& bytes, std::size_t at, const std::string& path) {
  auto left = static_cast<std::int64_t>(byte_at(bytes, at) << 8 | byte_at(bytes, at + 1)) - 2;
  at += 2;
  while (left > 0) {
    constexpr std::size_t lengths = 16, most_codes = 256;
    std::size_t codes = 0;
    for (std::size_t i = 0; i < lengths; ++i) codes += byte_at(bytes, at + 1 + i);
    if (codes > most_codes)
      throw InputError(fmt::format("{}: image is damaged; the table at byte {} has {} codes", path, at, codes));
    at += 1 + lengths + codes;
    left -= static_cast<std::int64_t>(1 + lengths + codes);
  }
}

// From marker to marker, over what lies between them.
void check_jpeg(const std::string& bytes, const std::string& path) {
  constexpr unsigned begin = 0xd8, end = 0xd9, huffman_tables = 0xc4, fill = 0xff;
  const auto is_alone = [](unsigned marker) {  // without a length: also what is no marker in compressed data
    return marker == 0 || marker == 1 || (marker >= 0xd0 && marker <= end);
  };
  std::size_t at = 0;
  bool has_begun = false;
  while (at < bytes.size()) {
    at = bytes.find('\xff', at);
    if (at == std::string::npos) return;
    while (byte_at(bytes, at) == fill && at < bytes.size()) ++at;
    const unsigned marker = byte_at(bytes, at++);
    if (!has_begun && marker != begin) return;  // no JPEG
    has_begun = true;
    if (marker == huffman_tables) check_huffman_tables(bytes, at, path);
    if (!is_alone(marker)) at += byte_at(bytes, at) << 8 | byte_at(bytes, at + 1);
  }
}

// Width, height, and the largest value.
void check_pnm(const std::string& bytes, const std::string& path) {
  constexpr int numbers = 3;
  constexpr std::size_t most_digits = 9;
  std::size_t at = 2;
  for (int i = 0; i < numbers; ++i) {
    at = std::min(bytes.find_first_not_of(" \t\n\v\f\r", at), bytes.size());
    while (at < bytes.size() && bytes[at] == '#') {
      at = std::min(bytes.find_first_of("\r\n", at), bytes.size());
      at = std::min(bytes.find_first_not_of(" \t\n\v\f\r", at), bytes.size());
    }
    const std::size_t end = std::min(bytes.find_first_not_of("0123456789", at), bytes.size());
    if (end - at > most_digits)
      throw InputError(fmt::format("{}: image is damaged; byte {}: a number of {} digits", path, at, end - at));
    at = end;
  }
}

}  // namespace

void check_png_checksums(const std::string& bytes, const std::string& path) {
  if (!bytes.starts_with("\x89PNG\r\n\x1a\n")) return;
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
    return value;
  };
  constexpr std::size_t signature = 8, around = 12;  // length, type, checksum
  for (std::size_t at = signature; at + around <= bytes.size();) {
    const std::size_t length = number(at);
    if (length > bytes.size() - at - around) return;  // what is missing is the library's to say
    const auto* from = reinterpret_cast<const Bytef*>(bytes.data() + at + 4);
    if (crc32(crc32(0, nullptr, 0), from, static_cast<uInt>(length + 4)) != number(at + 8 + length))
      throw InputError(fmt::format("{}: image is damaged; the checksum of the chunk at byte {} is wrong", path, at));
    if (bytes.compare(at + 4, 4, "IEND") == 0) return;
    at += length + around;
  }
}

void check_runs_of_hdr(const std::string& bytes, int width, int height, const std::string& path) {
  constexpr int least = 8, most = 32767;  // others have no runs
  if (width < least || width > most) return;
  const std::size_t empty_line = bytes.find("\n\n");
  std::size_t at = empty_line == std::string::npos ? empty_line : bytes.find('\n', empty_line + 2);
  if (at == std::string::npos) return;
  ++at;
  for (int row = 0; row < height; ++row) {
    const bool has_runs = byte_at(bytes, at) == 2 && byte_at(bytes, at + 1) == 2 && byte_at(bytes, at + 2) < 0x80;
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

void check_bitmap(const std::string& bytes, const std::string& path) {
  if (bytes.starts_with('\xff')) check_jpeg(bytes, path);
  if (bytes.starts_with("P5") || bytes.starts_with("P6")) check_pnm(bytes, path);
}

}  // namespace itn
