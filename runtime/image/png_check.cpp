#include "runtime/image/png_check.h"

#include <fmt/format.h>
#include <zlib.h>

#include <cstdint>
#include <string_view>

#include "itn/error.h"
#include "runtime/base/zlib_check.h"
#include "runtime/image/exif.h"

namespace itn {
namespace {

constexpr std::string_view signature("\x89PNG\r\n\x1a\n");

struct Chunk {
  std::string_view type, data;
};

// Goes through a file's chunks.
class Chunks {
 public:
  Chunks(std::string_view bytes, const std::string& path) : bytes_(bytes), path_(path) {}

  Chunk next() {
    constexpr std::size_t around = 12;  // length, type, checksum
    if (at_ + around > bytes_.size() || number(at_) > bytes_.size() - at_ - around)
      fail(fmt::format("it ends within the chunk at byte {}", at_));
    const std::size_t length = number(at_);
    const auto* from = reinterpret_cast<const Bytef*>(bytes_.data() + at_ + 4);
    if (crc32(crc32(0, nullptr, 0), from, static_cast<uInt>(length + 4)) != number(at_ + 8 + length))
      fail(fmt::format("the checksum of the chunk at byte {} is wrong", at_));
    const Chunk chunk{bytes_.substr(at_ + 4, 4), bytes_.substr(at_ + 8, length)};
    at_ += length + around;
    return chunk;
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: image is damaged; {}: copy or save it again", path_, what));
  }

 private:
  std::uint32_t number(std::size_t at) const {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes_[at + i]);
    return value;
  }

  std::string_view bytes_;
  const std::string& path_;
  std::size_t at_ = signature.size();
};

}  // namespace

bool is_png(const std::string& bytes) { return bytes.starts_with(signature); }

int check_png(const std::string& bytes, int width, int height, const std::string& path) {
  constexpr std::uint64_t largest_pixel = 8, passes = 7;  // bytes; of an interlaced image, each with a filter a row
  const auto rows = static_cast<std::uint64_t>(height);
  ZlibCheck pixels(static_cast<std::uint64_t>(width) * rows * largest_pixel + passes * (rows + 1));
  Chunks chunks(bytes, path);
  int orientation = 1;
  for (Chunk chunk = chunks.next(); chunk.type != "IEND"; chunk = chunks.next()) {
    if (chunk.type == "CgBI")
      throw InputError(path + ": is a PNG of Apple's own kind (CgBI), whose colours are in another order; convert it");
    if (chunk.type == "IDAT") pixels.add(chunk.data);
    if (chunk.type == "eXIf") orientation = exif_orientation(chunk.data);
  }
  if (const std::string fault = pixels.fault(); !fault.empty()) chunks.fail(fault);
  return orientation;
}

}  // namespace itn
