// Checks of bitmap files that stb_image does not make.
#pragma once
#include <string>

namespace itn {

bool is_pnm(const std::string& bytes);  // with binary samples

// The largest value that a PNM says its samples may have: stb_image does not scale by it. Throws InputError: one of its
// numbers is too large for stb_image.
int largest_of_pnm(const std::string& bytes, const std::string& path);

// Throws InputError: an HDR image of that size with a run of no pixels, as are all behind its end: stb_image would
// never end; or with runs in some rows alone: it would begin anew.
void check_runs_of_hdr(const std::string& bytes, int width, int height, const std::string& path);

}  // namespace itn
