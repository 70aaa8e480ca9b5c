// 8-bit PNG files.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace itn {

// rgb: row-major, three bytes a pixel, sRGB-encoded. name: of the picture, for messages. ResultError: no memory.
std::string encode_png(const std::string& name, int width, int height, const std::vector<std::uint8_t>& rgb);

// The same as a file. Written whole or not at all: ResultError otherwise.
void write_png(const std::string& path, int width, int height, const std::vector<std::uint8_t>& rgb);

}  // namespace itn
