// 8-bit PNG files, and textures from PNG, JPEG or OpenEXR files.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/scene/scene.h"

namespace itn {

// rgb: row-major, three bytes a pixel, sRGB-encoded. Written whole or not at all: ResultError otherwise.
void write_png(const std::string& path, int width, int height, const std::vector<std::uint8_t>& rgb);

// Linear values. PNG and JPEG samples are decoded from sRGB unless `raw`, those of OpenEXR files are linear already.
// One channel for grey (or Y only) files, three otherwise; transparency is ignored. Throws InputError.
Bitmap read_bitmap(const std::string& path, bool raw = false);

// sRGB transfer function (IEC 61966-2-1); both arguments in [0, 1].
double srgb_encode(double linear);
double srgb_decode(double encoded);

}  // namespace itn
