#include "runtime/image/exr_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>

#include "itn/error.h"

namespace itn {
namespace {

constexpr std::uint64_t most_values = std::uint64_t{1} << 30;  // 4 GiB
constexpr std::uint64_t most_of_byte = 1100;                   // bytes that a compressed one becomes, by zlib at most
constexpr std::uint64_t always_allowed = 1 << 20;              // other methods may do better: small images may be even
constexpr std::int64_t rows_of_chunk = 256;                    // at most, of the method with the largest chunks
constexpr std::uint64_t bytes_of_place = 8;                    // that the file's table has for a chunk

// Bytes of the types of one size [OpenEXR's ImfStdAttributes].
std::optional<std::int32_t> size_of(std::string_view type) {
  struct Size {
    std::string_view type;
    std::int32_t bytes;
  };
  constexpr std::array sizes{
      Size{"box2f", 16},      Size{"box2i", 16},    Size{"chromaticities", 32},
      Size{"compression", 1}, Size{"double", 8},    Size{"deepImageState", 1},
      Size{"envmap", 1},      Size{"float", 4},     Size{"int", 4},
      Size{"keycode", 28},    Size{"lineOrder", 1}, Size{"m33f", 36},
      Size{"m33d", 72},       Size{"m44f", 64},     Size{"m44d", 128},
      Size{"rational", 8},    Size{"tiledesc", 9},  Size{"timecode", 8},
      Size{"v2i", 8},         Size{"v2f", 8},       Size{"v2d", 16},
      Size{"v3i", 12},        Size{"v3f", 12},      Size{"v3d", 24},
  };
  for (const Size& size : sizes)
    if (size.type == type) return size.bytes;
  return {};
}

class Header {
 public:
  Header(std::string_view bytes, const std::string& file) : bytes_(bytes), file_(file) {}

  void check() {
    constexpr std::size_t magic_and_version = 8;
    if (bytes_.size() < magic_and_version) fail("ends within its header");
    const bool has_parts = (number(4) & 0x1000) != 0;
    at_ = magic_and_version;
    while (!at_header_end()) {
      while (!at_header_end()) read_attribute();
      ++at_;
      check_size();
      if (!has_parts) return;
    }
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(file_ + ": OpenEXR file is damaged; " + what + ": copy or render it again");
  }

  std::int32_t number(std::size_t at) const {
    std::int32_t value = 0;
    if (bytes_.size() < at + sizeof value) fail("ends within its header");
    std::memcpy(&value, bytes_.data() + at, sizeof value);
    return value;
  }

  bool at_header_end() const {
    if (at_ >= bytes_.size()) fail("ends within its header");
    return bytes_[at_] == '\0';
  }

  std::string_view name() {
    constexpr std::size_t longest = 255;
    const std::size_t end = bytes_.substr(0, at_ + longest + 1).find('\0', at_);
    if (end == std::string_view::npos) fail(fmt::format("byte {}: a name without an end", at_));
    const std::string_view result = bytes_.substr(at_, end - at_);
    at_ = end + 1;
    return result;
  }

  void read_attribute() {
    const std::size_t begin = at_;
    const std::string_view called = name(), type = name();
    const std::int32_t size = number(at_);
    at_ += sizeof size;
    if (size < 0 || static_cast<std::uint64_t>(size) > bytes_.size() - at_)
      fail(fmt::format("byte {}: an attribute of {} bytes, in a file of {}", begin, static_cast<std::uint32_t>(size),
                       bytes_.size()));
    // OpenEXR reads what a type takes, whatever the size says, and takes the next attribute from where it then is.
    if (const std::optional<std::int32_t> need = size_of(type); need && *need != size)
      fail(fmt::format("byte {}: an attribute of type {} and {} bytes, which takes {}", begin, type, size, *need));
    if (called == "dataWindow" && type == "box2i") read_window();
    if (called == "tiles" && type == "tiledesc") read_tile();
    if (type == "chlist") count_channels(called == "channels", at_ + static_cast<std::size_t>(size));
    if (type == "preview") check_preview(begin, size);
    if (type == "stringvector") check_texts(begin, size);
    if (type == "idmanifest") fail(fmt::format("byte {}: a list of ids, which is not read here", begin));
    at_ += static_cast<std::size_t>(size);
  }

  void read_window() {
    width_ = std::int64_t{number(at_ + 8)} - number(at_) + 1;
    height_ = std::int64_t{number(at_ + 12)} - number(at_ + 4) + 1;
  }

  void read_tile() {
    tile_width_ = static_cast<std::uint32_t>(number(at_));
    tile_height_ = static_cast<std::uint32_t>(number(at_ + 4));
  }

  void count_channels(bool are_of_image, std::size_t end) {
    const std::size_t begin = at_;
    constexpr std::size_t of_channel = 16;  // behind its name
    std::uint64_t count = 0;
    while (at_ < end && bytes_[at_] != '\0') {
      name();
      at_ += of_channel;
      ++count;
    }
    if (at_ + 1 != end) fail(fmt::format("byte {}: a list of channels that does not end where it should", begin));
    at_ = begin;
    if (are_of_image) channels_ = count;
  }

  void check_preview(std::size_t begin, std::int32_t size) const {
    constexpr std::int32_t of_size = 8, of_pixel = 4;
    if (size < of_size) fail(fmt::format("byte {}: a preview of {} bytes", begin, size));
    const auto pixels = std::uint64_t{static_cast<std::uint32_t>(number(at_))} *
                        std::uint64_t{static_cast<std::uint32_t>(number(at_ + 4))};
    if (pixels != static_cast<std::uint64_t>(size - of_size) / of_pixel || size % of_pixel != 0)
      fail(fmt::format("byte {}: a preview of {} pixels in {} bytes", begin, pixels, size));
  }

  // Each with its length before it.
  void check_texts(std::size_t begin, std::int32_t size) const {
    const std::size_t end = at_ + static_cast<std::size_t>(size);
    std::size_t at = at_;
    while (at < end) {
      const std::int32_t length = number(at);
      at += sizeof length;
      if (length < 0 || at > end || static_cast<std::size_t>(length) > end - at)
        fail(fmt::format("byte {}: a list of texts that does not end where it should", begin));
      at += static_cast<std::size_t>(length);
    }
  }

  void check_size() const {
    constexpr std::int64_t longest_side = 1 << 20;
    if (width_ < 1 || height_ < 1) fail("has no data window, or an empty one");
    if (width_ > longest_side || height_ > longest_side)
      throw InputError(
          fmt::format("{}: {} x {} pixels; at most {} a side are read", file_, width_, height_, longest_side));
    const auto pixels = static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(height_);
    const std::uint64_t values = pixels * std::max<std::uint64_t>(channels_, 1);
    if (channels_ > most_values / pixels || values > most_values)
      throw InputError(fmt::format("{}: {} x {} pixels of {} channels; at most {} values (4 GiB) are read", file_,
                                   width_, height_, channels_, most_values));
    // Half a number has two bytes.
    if (2 * values > always_allowed + most_of_byte * bytes_.size())
      fail(fmt::format("promises {} x {} pixels of {} channels, more than its {} bytes can hold", width_, height_,
                       channels_, bytes_.size()));
    check_chunks(pixels);
  }

  void check_chunks(std::uint64_t pixels) const {
    std::uint64_t chunks = static_cast<std::uint64_t>((height_ + rows_of_chunk - 1) / rows_of_chunk);
    if (tile_width_ > 0 && tile_height_ > 0) {
      const auto width = static_cast<std::uint64_t>(width_), height = static_cast<std::uint64_t>(height_);
      chunks = (width + tile_width_ - 1) / tile_width_ * ((height + tile_height_ - 1) / tile_height_);
      const std::uint64_t of_tile = std::uint64_t{tile_width_} * tile_height_;
      constexpr std::uint64_t usual = 1 << 20;  // pixels of a tile that may be larger than the image
      if (of_tile > std::max(usual, 4 * pixels))
        fail(fmt::format("has tiles of {} pixels, and {} in all", of_tile, pixels));
    }
    if (chunks > bytes_.size() / bytes_of_place)
      fail(fmt::format("promises {} chunks in {} bytes", chunks, bytes_.size()));
  }

  std::string_view bytes_;
  const std::string& file_;
  std::size_t at_ = 0;
  std::int64_t width_ = 0, height_ = 0;
  std::uint32_t tile_width_ = 0, tile_height_ = 0;
  std::uint64_t channels_ = 0;
};

}  // namespace

void check_exr_header(std::string_view bytes, const std::string& file) { Header(bytes, file).check(); }

}  // namespace itn
