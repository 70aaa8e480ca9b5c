// What stb_image does not look at before it believes a file.
#pragma once
#include <string>

namespace itn {

// Throws InputError: a PNG with a wrong checksum; a JPEG with a Huffman table of more than 256 codes, which stb_image
// would write behind its own; a PNM whose numbers do not fit.
void check_bitmap(const std::string& bytes, const std::string& path);

}  // namespace itn
