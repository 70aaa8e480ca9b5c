#include "runtime/image/png.h"

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_NO_STDIO
#define STBI_ONLY_JPEG
#define STBI_ONLY_PNG
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image.h>
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

#include <cmath>
#include <memory>
#include <stdexcept>

#include "runtime/error.h"
#include "runtime/image/exr.h"
#include "runtime/image/file.h"

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

}  // namespace

double srgb_encode(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

double srgb_decode(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

void write_png(const std::string& path, int width, int height, const std::vector<std::uint8_t>& rgb) {
  if (width <= 0 || height <= 0 || rgb.size() != 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::logic_error("write_png: data and size disagree");
  std::string bytes;
  const auto append = [](void* context, void* data, int size) {
    static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
  };
  if (!stbi_write_png_to_func(append, &bytes, width, height, 3, rgb.data(), 3 * width))
    throw ResultError(path + ": encoding the PNG failed; is there memory left?");
  write_file(path, bytes);
}

Bitmap read_bitmap(const std::string& path, bool raw) {
  const std::string bytes = read_file(path);
  if (bytes.starts_with("\x76\x2f\x31\x01")) return bitmap_of_exr(path);
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const int size = static_cast<int>(bytes.size());
  Bitmap bitmap;
  int file_channels = 0;
  if (!stbi_info_from_memory(data, size, &bitmap.width, &bitmap.height, &file_channels))
    throw InputError(path + ": is no PNG, JPEG or OpenEXR image (" + stbi_failure_reason() + "); convert it");
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
