// Textures and environment maps from OpenEXR, PNG, JPEG, TIFF, BMP, TGA, PNM (PPM, PGM) or HDR (RGBE) files.
#pragma once
#include <string>

#include "runtime/scene/scene.h"

namespace itn {

// Linear values. Samples of integers are decoded from sRGB unless `raw`; those of OpenEXR and HDR files are linear.
// One channel for grey (or Y only) files, three otherwise; transparency is ignored. Throws InputError.
Bitmap read_bitmap(const std::string& path, bool raw = false);

}  // namespace itn
