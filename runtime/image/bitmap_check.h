// What stb_image does not look at before it believes a file.
#pragma once
#include <string>

namespace itn {

// Throws InputError: a PNM image whose numbers are too large for it.
void check_pnm(const std::string& bytes, const std::string& path);

// Throws InputError: an HDR image of that size with a run of no pixels, as are all behind its end: stb_image would
// never end.
void check_runs_of_hdr(const std::string& bytes, int width, int height, const std::string& path);

}  // namespace itn
