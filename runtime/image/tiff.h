// TIFF files: 8 or 16 bits a sample, grey or RGB, with or without alpha, in strips.
#pragma once
#include <string>

#include "runtime/image/samples.h"

namespace itn {

bool is_tiff(const std::string& bytes);

// As read_samples(): the first picture of the file. Throws InputError: damaged, another kind of TIFF.
Samples read_tiff(const std::string& bytes, const std::string& path);

}  // namespace itn
