// Textures and environment maps from OpenEXR, PNG, JPEG, TIFF, BMP, TGA, PNM (PPM, PGM) or HDR (RGBE) files.
#pragma once
#include <string>
#include <vector>

namespace itn {

// Row 0 is on top. Linear; 1 or 3 channels.
struct Bitmap {
  int width = 0, height = 0, channels = 3;
  std::vector<float> data;  // row by row, channels interleaved
};

// Linear values. Samples of integers are decoded from sRGB unless `raw`; those of OpenEXR and HDR files are linear.
// One channel for grey (or Y only) files, three otherwise; transparency is ignored. Throws InputError.
Bitmap read_bitmap(const std::string& path, bool raw = false);

}  // namespace itn
