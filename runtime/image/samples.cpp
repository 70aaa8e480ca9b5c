#include "runtime/image/samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "itn/error.h"
#include "runtime/image/bitmap_check.h"
#include "runtime/image/image_size.h"
#include "runtime/image/jpeg.h"
#include "runtime/image/palette_check.h"
#include "runtime/image/png_check.h"
#include "runtime/image/stb_reader.h"
#include "runtime/image/tiff.h"

namespace itn {
namespace {

constexpr std::uint64_t most_pixels_of_byte = 8 * 1100;  // of two colours, by zlib; other formats stay below

void check_size(int width, int height, const std::string& bytes, const std::string& path) {
  check_image_size(static_cast<std::uint64_t>(std::max(width, 0)), static_cast<std::uint64_t>(std::max(height, 0)),
                   most_pixels_of_byte, bytes.size(), path);
}

// Samples of a PNM from 0 to `largest`, the greater byte first where they have two.
void set_pnm_range(Samples& samples, int largest, const std::string& path) {
  constexpr int byte = 257, most = 65535;
  for (std::uint16_t& sample : samples.data) {
    const int value = samples.bits == 16 ? (sample >> 8 | (sample & 0xff) << 8) : sample / byte;
    if (value > largest)
      throw InputError(fmt::format("{}: image is damaged; a sample is {}, and the largest is {}: copy or save it again",
                                   path, value, largest));
    sample = static_cast<std::uint16_t>((2 * value * std::int64_t{most} + largest) / (2 * largest));
  }
}

}  // namespace

std::optional<HdrValues> read_hdr(const std::string& bytes, const std::string& path) {
  if (!stb_is_hdr(bytes)) return std::nullopt;
  if (const auto size = stb_size(bytes)) {
    check_size(size->width, size->height, bytes, path);
    check_runs_of_hdr(bytes, size->width, size->height, path);
  }
  StbImage<float> image = stb_radiance(bytes, path);
  return HdrValues{image.width, image.height, std::move(image.data)};
}

Samples read_samples(const std::string& bytes, const std::string& path) {
  constexpr std::size_t most_bytes = std::numeric_limits<int>::max();
  if (bytes.size() > most_bytes)
    throw InputError(
        fmt::format("{}: {} bytes; at most {} are read: convert it to OpenEXR", path, bytes.size(), most_bytes));
  if (is_tiff(bytes)) return read_tiff(bytes, path);
  if (is_jpeg(bytes)) return read_jpeg(bytes, path);
  const int largest = is_pnm(bytes) ? largest_of_pnm(bytes, path) : 0;
  const auto size = stb_size(bytes);
  if (!size)
    throw InputError(path + ": is no OpenEXR, PNG, JPEG, TIFF, BMP, TGA, PNM or HDR image (" + stb_failure() +
                     "); convert it");
  check_size(size->width, size->height, bytes, path);
  Samples result;
  if (is_png(bytes)) result.orientation = check_png(bytes, size->width, size->height, path);
  result.bits = stb_is_deep(bytes) ? 16 : 8;
  StbImage<std::uint16_t> image = stb_samples(bytes, path);
  check_palette(bytes, path);
  result.width = image.width;
  result.height = image.height;
  result.channels = image.channels;
  result.data = std::move(image.data);
  if (largest > 0) set_pnm_range(result, largest, path);
  return result;
}

Samples oriented(Samples samples) {
  const int orientation = std::exchange(samples.orientation, 1);
  if (orientation == 1) return samples;
  const bool transposed = orientation >= 5;
  Samples result = samples;
  if (transposed) std::swap(result.width, result.height);
  const auto channels = static_cast<std::size_t>(samples.channels);
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x) {
      int from_x = transposed ? y : x, from_y = transposed ? x : y;
      if (orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8)
        from_x = samples.width - 1 - from_x;
      if (orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7)
        from_y = samples.height - 1 - from_y;
      const auto at = [&](int column, int row, int width) {
        return (static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column)) *
               channels;
      };
      for (std::size_t c = 0; c < channels; ++c)
        result.data[at(x, y, result.width) + c] = samples.data[at(from_x, from_y, samples.width) + c];
    }
  return result;
}

}  // namespace itn
