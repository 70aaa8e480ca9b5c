#include "runtime/image/exif.h"

#include <cstddef>
#include <cstdint>

namespace itn {
namespace {

// Numbers of an EXIF block, of either byte order; 0 beyond its end.
class ExifNumbers {
 public:
  explicit ExifNumbers(std::string_view bytes) : bytes_(bytes), little_(bytes.starts_with('I')) {}
  std::uint32_t at(std::size_t offset, std::size_t size) const {
    if (offset > bytes_.size() || size > bytes_.size() - offset) return 0;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value = value << 8 | static_cast<unsigned char>(bytes_[offset + (little_ ? size - 1 - i : i)]);
    return value;
  }

 private:
  std::string_view bytes_;
  bool little_;
};

}  // namespace

int exif_orientation(std::string_view block) {
  constexpr std::size_t entry = 12;
  constexpr std::uint32_t name = 0x0112, last = 8;
  constexpr std::string_view head("Exif\0\0", 6);
  if (block.starts_with(head)) block.remove_prefix(head.size());
  const ExifNumbers exif(block);
  const std::size_t directory = exif.at(4, 4);
  for (std::size_t i = 0; i < exif.at(directory, 2); ++i) {
    const std::uint32_t value = exif.at(directory + 2 + entry * i + 8, 2);
    if (exif.at(directory + 2 + entry * i, 2) == name && value >= 1 && value <= last) return static_cast<int>(value);
  }
  return 1;
}

}  // namespace itn
