#include "runtime/image/palette_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "itn/error.h"
#include "runtime/image/png_check.h"
#include "runtime/image/stb_reader.h"

namespace itn {
namespace {

unsigned byte_at(const std::string& bytes, std::size_t at) {
  return at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : 0;
}
unsigned little(const std::string& bytes, std::size_t at, std::size_t size) {
  unsigned value = 0;
  for (std::size_t i = size; i-- > 0;) value = value << 8 | byte_at(bytes, at + i);
  return value;
}

void require(unsigned index, unsigned colours, const std::string& path) {
  if (index >= colours)
    throw InputError(fmt::format("{}: image is damaged; a pixel is of colour {}, and its palette has {}: save it again",
                                 path, index, colours));
}

// grey: the same file without its palette, whose samples of so many bits are then the numbers of the colours.
void check_grey(const std::string& grey, unsigned bits, unsigned colours, const std::string& path) {
  constexpr unsigned largest = 65535;
  const StbImage<std::uint16_t> image = stb_samples(grey, path);
  for (std::size_t i = 0; i < image.data.size(); i += static_cast<std::size_t>(image.channels))
    require(image.data[i] / (largest / ((1U << bits) - 1)), colours, path);
}

void check_png_palette(std::string bytes, const std::string& path) {
  constexpr std::size_t signature = 8, depth = 24, colour_type = 25, around = 12;
  constexpr unsigned by_palette = 3;
  if (byte_at(bytes, colour_type) != by_palette) return;
  const unsigned bits = byte_at(bytes, depth);
  unsigned colours = 0;
  for (std::size_t at = signature; at + around <= bytes.size();) {
    const std::size_t length =
        byte_at(bytes, at) << 24 | byte_at(bytes, at + 1) << 16 | byte_at(bytes, at + 2) << 8 | byte_at(bytes, at + 3);
    if (bytes.compare(at + 4, 4, "PLTE") == 0) colours = static_cast<unsigned>(length / 3);
    if (bytes.compare(at + 4, 4, "tRNS") == 0) bytes[at + 7] = 's';  // a chunk that nobody knows
    at += length + around;
  }
  if (colours >= 1U << bits) return;
  bytes[colour_type] = 0;
  check_grey(bytes, bits, colours, path);
}

void check_bmp_palette(const std::string& bytes, const std::string& path) {
  constexpr std::size_t file_header = 14, oldest = 12;
  const std::size_t header = little(bytes, 14, 4), data = little(bytes, 10, 4);
  const bool is_old = header == oldest;
  const unsigned width = is_old ? little(bytes, 18, 2) : little(bytes, 18, 4),
                 bits = little(bytes, is_old ? 24 : 28, 2);
  const int height = is_old ? static_cast<int>(little(bytes, 20, 2)) : static_cast<int>(little(bytes, 22, 4));
  if (bits > 8 || data < file_header + header) return;
  const auto colours = static_cast<unsigned>((data - file_header - header) / (is_old ? 3 : 4));
  if (colours >= 1U << bits) return;
  const std::size_t row = (std::size_t{width} * bits + 31) / 32 * 4;
  for (std::size_t y = 0; y < static_cast<std::size_t>(std::abs(height)); ++y)
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t bit = x * bits;
      const unsigned byte = byte_at(bytes, data + y * row + bit / 8);
      require(byte >> (8 - bits - bit % 8) & ((1U << bits) - 1), colours, path);
    }
}

void check_tga_palette(std::string bytes, const std::string& path) {
  constexpr std::size_t header = 18, of_type = 2, of_map = 3, size_of_map = 5;
  const unsigned kind = byte_at(bytes, of_type) & 7U;
  if (byte_at(bytes, 1) == 0 || kind != 1) return;
  const unsigned first = little(bytes, of_map, 2), colours = little(bytes, of_map + 2, 2),
                 bits = byte_at(bytes, of_map + 4);
  if (first != 0)
    throw InputError(
        fmt::format("{}: TGA whose palette begins with colour {}; need one from 0: convert it", path, first));
  constexpr unsigned most = 256;
  if (byte_at(bytes, 16) != 8 || colours >= most) return;
  bytes.erase(std::min(bytes.size(), header + byte_at(bytes, 0)), std::size_t{colours} * ((bits + 7) / 8));
  bytes[1] = 0;
  bytes[of_type] = static_cast<char>(byte_at(bytes, of_type) + 2);  // grey, with runs or without
  bytes.replace(of_map, size_of_map, size_of_map, '\0');
  check_grey(bytes, 8, colours, path);
}

}  // namespace

void check_palette(const std::string& bytes, const std::string& path) {
  if (is_png(bytes)) return check_png_palette(bytes, path);
  if (bytes.starts_with("BM")) return check_bmp_palette(bytes, path);
  if (!bytes.starts_with("P5") && !bytes.starts_with("P6")) check_tga_palette(bytes, path);
}

}  // namespace itn
