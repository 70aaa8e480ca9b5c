// Can these be radiance?
#pragma once
#include <functional>
#include <string>
#include <vector>

namespace itn {

// The reason why an image of finite values is no radiance, for a message; empty: it may be one. Noise around black may
// be below 0: without these pixels the mean of the others would be too high.
std::string wrong_with_radiance(const std::vector<float>& values);

// The same, and refuses a value farther below 0 than the mean is above: that is no noise, but a damaged pixel. place:
// describes where a value is, for the message.
std::string wrong_with_target(const std::vector<float>& values, const std::function<std::string(std::size_t)>& place);

}  // namespace itn
