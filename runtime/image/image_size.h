// Limits of a file's image size, checked before memory is taken for what its header promises.
#pragma once
#include <fmt/format.h>

#include <cstdint>
#include <string>

#include "itn/error.h"

namespace itn {

// most_pixels_of_byte: what the format's compression can make of a byte. Throws InputError.
inline void check_image_size(std::uint64_t width, std::uint64_t height, std::uint64_t most_pixels_of_byte,
                             std::uint64_t bytes, const std::string& path) {
  constexpr std::uint64_t most_pixels = 1 << 27;  // 16384 x 8192
  if (width < 1 || height < 1 || width > most_pixels || height > most_pixels || width * height > most_pixels)
    throw InputError(
        fmt::format("{}: {} x {} pixels; from 1 to {} are read: make it smaller", path, width, height, most_pixels));
  if (width * height > most_pixels_of_byte * bytes)
    throw InputError(fmt::format("{}: image is damaged; promises {} x {} pixels, more than its {} bytes can hold", path,
                                 width, height, bytes));
}

}  // namespace itn
