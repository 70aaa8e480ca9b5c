#include "runtime/image/png.h"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

#include <stdexcept>

#include "itn/error.h"
#include "itn/file.h"

namespace itn {

std::string encode_png(const std::string& name, int width, int height, const std::vector<std::uint8_t>& rgb) {
  if (width <= 0 || height <= 0 || rgb.size() != 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw std::logic_error("encode_png: data and size disagree");
  std::string bytes;
  const auto append = [](void* context, void* data, int size) {
    static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
  };
  if (!stbi_write_png_to_func(append, &bytes, width, height, 3, rgb.data(), 3 * width))
    throw ResultError(name + ": encoding the PNG failed; is there memory left?");
  return bytes;
}

void write_png(const std::string& path, int width, int height, const std::vector<std::uint8_t>& rgb) {
  write_file(path, encode_png(path, width, height, rgb));
}

}  // namespace itn
