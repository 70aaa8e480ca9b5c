// Samples of integers as PNG, JPEG, BMP, TGA, PNM (PPM, PGM) and TIFF files have them, and what a camera notes beside.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace itn {

struct Samples {
  int width = 0, height = 0;
  int channels = 0;  // 1: grey; 2: grey, alpha; 3: red, green, blue; 4: these and alpha
  int bits = 8;      // of each sample in the file: 8 or 16
  bool is_tiff = false;
  int orientation = 1;              // EXIF orientation; 1: row 0 is on top; oriented() undoes the others
  std::vector<std::uint16_t> data;  // row-major, interleaved; 8-bit samples v become 257 v

  bool has_alpha() const { return channels == 2 || channels == 4; }
  int colours() const { return has_alpha() ? channels - 1 : channels; }
};

// bytes: of the whole file; path: for messages. Throws InputError: another format, damaged, more pixels than are read.
Samples read_samples(const std::string& bytes, const std::string& path);

// Rows and columns as somebody sees them who looks at the picture.
Samples oriented(Samples samples);

// Linear red, green and blue of a Radiance HDR file (shared exponent); none: it is another file. Throws InputError.
struct HdrValues {
  int width = 0, height = 0;
  std::vector<float> data;
};
std::optional<HdrValues> read_hdr(const std::string& bytes, const std::string& path);

}  // namespace itn
