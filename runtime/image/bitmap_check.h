// What stb_image does not look at before it believes a file.
#pragma once
#include <string>

namespace itn {

// Before anything else. Throws InputError: a JPEG with a Huffman table of more than 256 codes, which stb_image
// would write behind its own; a PNM whose numbers do not fit.
void check_bitmap(const std::string& bytes, const std::string& path);

// Throws InputError: a PNG with a wrong checksum.
void check_png_checksums(const std::string& bytes, const std::string& path);

// Throws InputError: an HDR image of that size with a run of no pixels, as are all behind its end: stb_image would
// never end.
void check_runs_of_hdr(const std::string& bytes, int width, int height, const std::string& path);

}  // namespace itn
