// Multi-scale structural similarity (Wang, Simoncelli, Bovik 2003) of two images of one channel: 1 for equal images.
#pragma once
#include <span>
#include <vector>

namespace itn {

// The weights of the scales, finest first, for images whose shorter side has so many pixels. The paper's five where
// they fit: the coarsest scale must still hold the window of 11x11, so 176 pixels are needed. Smaller images get as
// many scales as fit, with the paper's first weights, made to sum to one: four from 88 pixels on, three from 44. Throws
// UsageError below 11 pixels.
std::vector<double> ms_ssim_weights(int shorter_side);

// image, reference: width * height numbers, row-major; data_range: the largest value there can be, or that of the
// reference where there is none (what keeps the quotients stable is 0.01 and 0.03 of it). Gaussian window of 11 pixels,
// sigma 1.5, only where it lies inside; scales are halved by means over 2x2 pixels, without an odd last row or column.
// A scale whose structure is on the mean the opposite of the reference's makes the result 0.
// Throws UsageError: sizes that do not fit, a data range that is not above 0.
double ms_ssim(std::span<const float> image, std::span<const float> reference, int width, int height,
               double data_range);

}  // namespace itn
