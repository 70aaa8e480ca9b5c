// The part of an image that shows its object.
#pragma once
#include <vector>

namespace itn {

// The smallest rectangle of pixels that holds an object, and which of them show it.
struct ObjectWindow {
  int left = 0, top = 0, width = 0, height = 0;
  std::vector<float> weight;  // row-major: 1 where the object is seen, else 0
};

// mask: (size, size), above 0 where the object is seen. Throws UsageError where that is nowhere.
ObjectWindow object_window(const std::vector<float>& mask, int size);

// The window's part of an image, (size, size).
std::vector<float> cut(const std::vector<float>& image, int size, const ObjectWindow& window);

}  // namespace itn
