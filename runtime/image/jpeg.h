// JPEG files, by libjpeg.
#pragma once
#include <string>

#include "runtime/image/samples.h"

namespace itn {

inline bool is_jpeg(const std::string& bytes) { return bytes.starts_with("\xff\xd8\xff"); }

// As read_samples(): grey, or RGB. Throws InputError: damaged (also where the library could guess what is missing), or
// of other colours.
Samples read_jpeg(const std::string& bytes, const std::string& path);

}  // namespace itn
