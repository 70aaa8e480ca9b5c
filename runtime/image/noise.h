// Estimates the noise of a picture from the picture itself.
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

// Adds the variance of counted photons (Poisson), a gain times the value, to the squares of `noise`, the standard
// deviations of `value`. Each channel's gain comes from the picture: from the responses of the Laplacian mask of
// Immerkaer (1996), which is 0 on planes, at pixels of about the same value, by medians, so that edges do not count.
// The value is the mean of the neighbours: a pixel's own value would give more weight to those that are too dark by
// chance. Noise that neighbours share (demosaicing, JPEG) is underestimated; Monte Carlo noise, which comes in
// outliers, by up to a fifth.
void add_photon_noise(const PixelView& picture, const Rounding& rounding, std::vector<float>& noise);

}  // namespace itn
