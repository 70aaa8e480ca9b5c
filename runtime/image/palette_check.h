// Pixels of colours that a palette does not have.
#pragma once
#include <string>

namespace itn {

// bytes: of a PNG, BMP or TGA that stb_image has read: it takes what was in its memory, or the first colour, for
// colours beyond the palette. Throws InputError where there are some.
void check_palette(const std::string& bytes, const std::string& path);

}  // namespace itn
