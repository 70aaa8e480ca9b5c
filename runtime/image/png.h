// 8-bit PNG files.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace itn {

// rgb: row-major, three bytes a pixel, sRGB-encoded. Written whole or not at all: ResultError otherwise.
void write_png(const std::string& path, int width, int height, const std::vector<std::uint8_t>& rgb);

}  // namespace itn
