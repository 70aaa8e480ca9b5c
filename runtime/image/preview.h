// Pictures for the eye: 8-bit sRGB from linear data.
#pragma once
#include <cstdint>
#include <vector>

namespace itn {

// data: row-major, 1 or 3 interleaved linear channels, here and below.
// The factor with which the 98th percentile of luminance becomes 0.8, so a few fireflies or a small sun do not darken
// the picture; 1 for a black one.
double automatic_exposure(const std::vector<float>& data, int channels);

// Result: three bytes a pixel. Curve of the data times the exposure: linear up to 0.6, above it 1 - 0.4 exp(-(x - 0.6)
// / 0.4), which continues with the same slope and ends at white; then sRGB encoding. Pixels that are not finite become
// magenta.
std::vector<std::uint8_t> tone_mapped(const std::vector<float>& data, int channels, double exposure);
// With the automatic exposure.
std::vector<std::uint8_t> tone_mapped(const std::vector<float>& data, int channels);

struct SignedPicture {
  std::vector<std::uint8_t> bytes;
  double scale = 0;  // the absolute value of full red and full blue
};

// Mean over the channels; white at 0, red for positive, blue for negative values (as in the paper's figure 2), linear
// in sRGB and symmetric, saturated at the 99th percentile of the absolute values that are not 0, so that a large
// background does not matter. Pixels that are not finite become green.
SignedPicture red_blue(const std::vector<float>& data, int channels);

}  // namespace itn
