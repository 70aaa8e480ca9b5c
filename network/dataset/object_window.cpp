#include "network/dataset/object_window.h"

#include <algorithm>

#include "itn/error.h"

namespace itn {

ObjectWindow object_window(const std::vector<float>& mask, int size) {
  int left = size, top = size, right = -1, bottom = -1;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      if (mask[static_cast<std::size_t>(y * size + x)] > 0) {
        left = std::min(left, x);
        right = std::max(right, x);
        top = std::min(top, y);
        bottom = y;
      }
  if (right < 0) throw UsageError("the mask is 0 everywhere: no object can be seen");
  ObjectWindow window{left, top, right - left + 1, bottom - top + 1, {}};
  window.weight = cut(mask, size, window);
  for (float& weight : window.weight) weight = weight > 0 ? 1.0F : 0.0F;
  return window;
}

std::vector<float> cut(const std::vector<float>& image, int size, const ObjectWindow& window) {
  std::vector<float> result;
  result.reserve(static_cast<std::size_t>(window.width * window.height));
  for (int y = 0; y < window.height; ++y) {
    const auto row = image.begin() + (window.top + y) * size + window.left;
    result.insert(result.end(), row, row + window.width);
  }
  return result;
}

}  // namespace itn
