// TIFF files: 8 or 16 bits a sample, grey or RGB, with or without alpha, in strips.
#pragma once
#include <string>

#include "runtime/image/samples.h"

namespace itn {

inline bool is_tiff(const std::string& bytes) {
  return bytes.starts_with(std::string("II*\0", 4)) || bytes.starts_with(std::string("MM\0*", 4)) ||
         bytes.starts_with(std::string("II+\0", 4)) || bytes.starts_with(std::string("MM\0+", 4));
}

// As read_samples(): the first picture of the file. Throws InputError: damaged, another kind of TIFF.
Samples read_tiff(const std::string& bytes, const std::string& path);

}  // namespace itn
