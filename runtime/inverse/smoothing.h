// Means over the neighbours of pixels.
#pragma once
#include <vector>

namespace itn {

enum class Centre { in, out };

// Mean over squares of (2 radius + 1)^2 pixels, less where the image ends, with or without the pixel itself, channel by
// channel. data: row-major, channels interleaved.
std::vector<double> smoothed(const std::vector<double>& data, int width, int height, int channels, int radius,
                             Centre centre = Centre::in);

}  // namespace itn
