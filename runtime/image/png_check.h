// Checks of PNG files that stb_image does not make.
#pragma once
#include <string>

namespace itn {

bool is_png(const std::string& bytes);

// bytes: of a PNG of this size. Checks that all chunks are there up to the end, with the right checksums, and that the
// compressed data are whole. Returns the orientation that its EXIF block gives (exif.h). Throws InputError: damaged, or
// of a kind that is not read.
int check_png(const std::string& bytes, int width, int height, const std::string& path);

}  // namespace itn
