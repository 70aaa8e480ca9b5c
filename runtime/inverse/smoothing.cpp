#include "runtime/inverse/smoothing.h"

#include <algorithm>
#include <cstddef>

namespace itn {

std::vector<double> smoothed(const std::vector<double>& data, int width, int height, int channels, int radius,
                             Centre centre) {
  const auto count_of = static_cast<std::size_t>(channels);
  std::vector<double> result(data.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (std::size_t c = 0; c < count_of; ++c) {
        double sum = 0, count = 0;
        for (int v = std::max(0, y - radius); v <= std::min(height - 1, y + radius); ++v)
          for (int u = std::max(0, x - radius); u <= std::min(width - 1, x + radius); ++u, ++count)
            sum += data[static_cast<std::size_t>(v * width + u) * count_of + c];
        if (centre == Centre::out && count > 1) {
          sum -= data[static_cast<std::size_t>(y * width + x) * count_of + c];
          count -= 1;
        }
        result[static_cast<std::size_t>(y * width + x) * count_of + c] = sum / count;
      }
  return result;
}

}  // namespace itn
