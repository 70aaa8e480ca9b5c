// The camera's orientation from EXIF.
#pragma once
#include <string_view>

namespace itn {

// block: as TIFF files begin, "II*" or "MM", or with "Exif\0\0" before it. Returns the tag 0x0112 of its first
// directory, 1 to 8; 1 where there is none, or where the block is broken.
int exif_orientation(std::string_view block);

}  // namespace itn
