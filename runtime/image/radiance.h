// Can these be radiance?
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace itn {

// What keeps the values of an image, all finite, from being radiance, for a message; empty: nothing does. Noise around
// black may be below 0: without these pixels the mean of the others would be too high.
std::string wrong_with_radiance(const std::vector<float>& values);

// The first value that is farther below 0 than the mean is above: no noise, but a fault of the pixel.
std::optional<std::size_t> far_below_black(const std::vector<float>& values);

}  // namespace itn
