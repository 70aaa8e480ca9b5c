// Can these be radiance?
#pragma once
#include <string>
#include <vector>

namespace itn {

// What keeps the values of an image, all finite, from being radiance, for a message; empty: nothing does. Noise around
// black may be below 0: without these pixels the mean of the others would be too high.
std::string wrong_with_radiance(const std::vector<float>& values);

}  // namespace itn
