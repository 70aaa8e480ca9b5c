#include "runtime/image/bitmap.h"

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_NO_STDIO
#define STBI_ONLY_BMP
#define STBI_ONLY_HDR
#define STBI_ONLY_JPEG
#define STBI_ONLY_PNG
#define STBI_ONLY_PNM
#define STBI_ONLY_TGA
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

#include <fmt/format.h>

#include <cstdint>
#include <limits>
#include <memory>

#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/image/bitmap_check.h"
#include "runtime/image/exr.h"
#include "runtime/image/srgb.h"

namespace itn {
namespace {

Bitmap bitmap_of_exr(const std::string& path) {
  const ExrImage image = read_exr(path);
  std::vector<int> from{image.channel("R"), image.channel("G"), image.channel("B")};
  if (from[0] < 0 || from[1] < 0 || from[2] < 0) from = {image.channel("Y")};
  if (from[0] < 0) {
    std::string names;
    for (const std::string& name : image.channels) names += " " + name;
    throw InputError(path + ": channels are" + names + "; need R, G and B, or Y");
  }
  Bitmap bitmap{image.width, image.height, static_cast<int>(from.size()), {}};
  bitmap.data.reserve(image.data.size() / image.channels.size() * from.size());
  for (std::size_t at = 0; at < image.data.size(); at += image.channels.size())
    for (const int channel : from) bitmap.data.push_back(image.data[at + static_cast<std::size_t>(channel)]);
  return bitmap;
}

// Radiance's shared exponent: linear values.
Bitmap bitmap_of_hdr(const std::string& path, const stbi_uc* data, int size) {
  Bitmap bitmap;
  int file_channels = 0;
  const std::unique_ptr<float, void (*)(void*)> values(
      stbi_loadf_from_memory(data, size, &bitmap.width, &bitmap.height, &file_channels, bitmap.channels),
      stbi_image_free);
  if (!values) throw InputError(path + ": image is damaged; " + stbi_failure_reason());
  bitmap.data.assign(values.get(), values.get() + static_cast<std::size_t>(bitmap.width) *
                                                      static_cast<std::size_t>(bitmap.height) *
                                                      static_cast<std::size_t>(bitmap.channels));
  return bitmap;
}

// Before memory is taken for what the header promises.
void check_size(const Bitmap& bitmap, std::size_t bytes, const std::string& path) {
  constexpr std::uint64_t most_pixels = 1 << 27;           // 16384 x 8192
  constexpr std::uint64_t most_pixels_of_byte = 8 * 1100;  // of two colours, by zlib; other formats stay below
  const auto pixels = static_cast<std::uint64_t>(bitmap.width) * static_cast<std::uint64_t>(bitmap.height);
  if (bitmap.width < 1 || bitmap.height < 1 || pixels > most_pixels)
    throw InputError(fmt::format("{}: {} x {} pixels; from 1 to {} are read: make it smaller", path, bitmap.width,
                                 bitmap.height, most_pixels));
  if (pixels > most_pixels_of_byte * bytes)
    throw InputError(fmt::format("{}: image is damaged; promises {} x {} pixels, more than its {} bytes can hold", path,
                                 bitmap.width, bitmap.height, bytes));
}

}  // namespace

Bitmap read_bitmap(const std::string& path, bool raw) {
  const std::string bytes = read_file(path);
  if (bytes.starts_with("\x76\x2f\x31\x01")) return bitmap_of_exr(path);
  constexpr std::size_t most_bytes = std::numeric_limits<int>::max();
  if (bytes.size() > most_bytes)
    throw InputError(
        fmt::format("{}: {} bytes; at most {} are read: convert it to OpenEXR", path, bytes.size(), most_bytes));
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const int size = static_cast<int>(bytes.size());
  check_bitmap(bytes, path);
  Bitmap bitmap;
  int file_channels = 0;
  if (!stbi_info_from_memory(data, size, &bitmap.width, &bitmap.height, &file_channels))
    throw InputError(path + ": is no OpenEXR, PNG, JPEG, BMP, TGA, PNM or HDR image (" + stbi_failure_reason() +
                     "); convert it");
  check_size(bitmap, bytes.size(), path);
  check_png_checksums(bytes, path);
  if (stbi_is_hdr_from_memory(data, size)) {
    check_runs_of_hdr(bytes, bitmap.width, bitmap.height, path);
    return bitmap_of_hdr(path, data, size);
  }
  bitmap.channels = file_channels <= 2 ? 1 : 3;
  // 16 bits a sample whatever the file has: 8-bit samples v become 257 v.
  const std::unique_ptr<stbi_us, void (*)(void*)> samples(
      stbi_load_16_from_memory(data, size, &bitmap.width, &bitmap.height, &file_channels, bitmap.channels),
      stbi_image_free);
  if (!samples) throw InputError(path + ": image is damaged; " + stbi_failure_reason());
  const std::size_t values = static_cast<std::size_t>(bitmap.width) * static_cast<std::size_t>(bitmap.height) *
                             static_cast<std::size_t>(bitmap.channels);
  bitmap.data.resize(values);
  for (std::size_t i = 0; i < values; ++i) {
    const double encoded = samples.get()[i] / 65535.0;
    bitmap.data[i] = static_cast<float>(raw ? encoded : srgb_decode(encoded));
  }
  return bitmap;
}

}  // namespace itn
