// How noisy a picture is, as the picture itself shows.
#pragma once
#include <functional>
#include <optional>
#include <vector>

namespace itn {

// Row-major, channels interleaved; weight: one a pixel, 0 where it says nothing.
struct PixelView {
  int width, height, channels;
  const std::vector<float>& value;
  const std::vector<float>& weight;
};

// Standard deviation of what rounding does to a value; none where it hides all else.
using Rounding = std::function<std::optional<double>(double value)>;

// noise: standard deviations, as `value`; to their squares is added the variance of counted photons (Poisson), a gain
// times the value. The gain of each channel comes from the picture: what the Laplacian's mask of Immerkaer (1996),
// which planes leave at 0, shows at pixels of about the same value, by medians, so that edges do not count. The value
// is the mean of the pixels around: with its own each pixel that is too dark by chance would count for more. Noise that
// neighbours share (demosaicing, JPEG) is underestimated, that of paths, which comes in outliers, by up to a fifth.
void add_photon_noise(const PixelView& picture, const Rounding& rounding, std::vector<float>& noise);

}  // namespace itn
