// PNG, BMP, TGA, PNM and HDR files by stb_image, which says nothing where a file ends early: pixels are then zeros, or
// whatever was in its memory.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace itn {

template <class Number>
struct StbImage {
  int width = 0, height = 0, channels = 0;
  std::vector<Number> data;  // row-major, interleaved
};

// The size that a file promises, without data. None: no such file; stb_failure() says why.
std::optional<StbImage<std::uint16_t>> stb_size(const std::string& bytes);
std::string stb_failure();
bool stb_is_deep(const std::string& bytes);  // 16 bits a sample
bool stb_is_hdr(const std::string& bytes);

// Samples as read_samples() has them, but those of 16 bits of PNM in the file's order; radiance of HDR files, in red,
// green and blue. Throw InputError: damaged, or it ends early.
StbImage<std::uint16_t> stb_samples(const std::string& bytes, const std::string& path);
StbImage<float> stb_radiance(const std::string& bytes, const std::string& path);

}  // namespace itn
