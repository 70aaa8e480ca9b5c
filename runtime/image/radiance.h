// Can these be radiance?
#pragma once
#include <functional>
#include <string>
#include <vector>

namespace itn {

// What keeps the values of an image, all finite, from being radiance, for a message; empty: nothing does. Noise around
// black may be below 0: without these pixels the mean of the others would be too high.
std::string wrong_with_radiance(const std::vector<float>& values);

// The same, and of a value that is farther below 0 than the mean is above: no noise, but a fault of the pixel.
// place: of a value, for the message.
std::string wrong_with_target(const std::vector<float>& values, const std::function<std::string(std::size_t)>& place);

}  // namespace itn
