#include "runtime/image/samples.h"

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_NO_STDIO
#define STBI_ONLY_BMP
#define STBI_ONLY_HDR
#define STBI_ONLY_PNG
#define STBI_ONLY_PNM
#define STBI_ONLY_TGA
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

#include <fmt/format.h>
#include <zlib.h>

#include <limits>
#include <memory>
#include <utility>

#include "runtime/base/error.h"
#include "runtime/image/bitmap_check.h"
#include "runtime/image/image_size.h"
#include "runtime/image/jpeg.h"
#include "runtime/image/tiff.h"

namespace itn {
namespace {

constexpr std::uint64_t most_pixels_of_byte = 8 * 1100;  // of two colours, by zlib; other formats stay below

const stbi_uc* data_of(const std::string& bytes) { return reinterpret_cast<const stbi_uc*>(bytes.data()); }

// Those of a PNG's chunks, which the library does not look at.
void check_checksums(const std::string& bytes, const std::string& path) {
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

}  // namespace

std::optional<HdrValues> read_hdr(const std::string& bytes, const std::string& path) {
  constexpr std::size_t most_bytes = std::numeric_limits<int>::max();
  const int size = static_cast<int>(std::min(bytes.size(), most_bytes));
  if (!stbi_is_hdr_from_memory(data_of(bytes), size)) return std::nullopt;
  HdrValues result;
  int channels = 0;
  if (stbi_info_from_memory(data_of(bytes), size, &result.width, &result.height, &channels))
    check_image_size(static_cast<std::uint64_t>(result.width), static_cast<std::uint64_t>(result.height),
                     most_pixels_of_byte, bytes.size(), path);
  check_runs_of_hdr(bytes, result.width, result.height, path);
  const std::unique_ptr<float, void (*)(void*)> values(
      stbi_loadf_from_memory(data_of(bytes), size, &result.width, &result.height, &channels, 3), stbi_image_free);
  if (!values) throw InputError(path + ": image is damaged; " + stbi_failure_reason());
  const auto count = static_cast<std::size_t>(result.width) * static_cast<std::size_t>(result.height) * 3;
  result.data.assign(values.get(), values.get() + count);
  return result;
}

Samples read_samples(const std::string& bytes, const std::string& path) {
  constexpr std::size_t most_bytes = std::numeric_limits<int>::max();
  if (bytes.size() > most_bytes)
    throw InputError(
        fmt::format("{}: {} bytes; at most {} are read: convert it to OpenEXR", path, bytes.size(), most_bytes));
  if (is_tiff(bytes)) return read_tiff(bytes, path);
  if (is_jpeg(bytes)) return read_jpeg(bytes, path);
  check_pnm(bytes, path);
  const int size = static_cast<int>(bytes.size());
  Samples result;
  if (!stbi_info_from_memory(data_of(bytes), size, &result.width, &result.height, &result.channels))
    throw InputError(path + ": is no OpenEXR, PNG, JPEG, TIFF, BMP, TGA, PNM or HDR image (" + stbi_failure_reason() +
                     "); convert it");
  if (result.width < 1 || result.height < 1) result.width = result.height = 0;
  check_image_size(static_cast<std::uint64_t>(result.width), static_cast<std::uint64_t>(result.height),
                   most_pixels_of_byte, bytes.size(), path);
  check_checksums(bytes, path);
  result.bits = stbi_is_16_bit_from_memory(data_of(bytes), size) ? 16 : 8;
  // 16 bits a sample whatever the file has.
  const std::unique_ptr<stbi_us, void (*)(void*)> samples(
      stbi_load_16_from_memory(data_of(bytes), size, &result.width, &result.height, &result.channels, 0),
      stbi_image_free);
  if (!samples) throw InputError(path + ": image is damaged; " + stbi_failure_reason());
  result.data.assign(samples.get(), samples.get() + static_cast<std::size_t>(result.width) *
                                                        static_cast<std::size_t>(result.height) *
                                                        static_cast<std::size_t>(result.channels));
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
