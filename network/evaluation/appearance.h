// Difference between an image rendered with predicted parameters and the input image, both of them noisy.
#pragma once
#include <string>
#include <vector>

#include "itn/renderer.h"
#include "network/dataset/manifest.h"

namespace itn {

// An image of one channel with the standard error of every pixel.
struct NoisyImage {
  std::vector<float> value, error;  // row-major
};

// The set's image. Throws InputError: not readable, another size, no channel Y or stderr.Y, numbers that are not
// finite.
NoisyImage read_noisy_image(const std::string& folder, const Manifest& set, const Manifest::Image& image);

struct Difference {
  double mean_square = 0;  // of rendered - input, less the variance of both images' noise: 0 on the mean where they are
                           // the same but for noise, and then as often below 0 as above
  double seen_mean_square = 0;  // noise included
  double structure = 0;         // 1 - MS-SSIM, noise included; NaN: too small for it (network/model/ms_ssim.h)
};

// rendered: luminance, from two samples a pixel or more, of the input's size.
Difference difference(const Rendering& rendered, const NoisyImage& input);

}  // namespace itn
