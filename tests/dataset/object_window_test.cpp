// The rectangle around an object.
#include "network/dataset/object_window.h"

#include <catch2/catch.hpp>

#include "itn/error.h"

using namespace itn;

TEST_CASE("an object's window is the smallest rectangle that holds it, and weighs its pixels alone") {
  std::vector<float> mask(16, 0.0F), image(16);
  for (std::size_t i = 0; i < 16; ++i) image[i] = static_cast<float>(i);
  mask[4 * 1 + 2] = mask[4 * 2 + 1] = mask[4 * 3 + 1] = 1;
  const ObjectWindow window = object_window(mask, 4);
  CHECK(window.left == 1);
  CHECK(window.top == 1);
  CHECK(window.width == 2);
  CHECK(window.height == 3);
  CHECK(window.weight == std::vector<float>{0, 1, 1, 0, 1, 0});
  CHECK(cut(image, 4, window) == std::vector<float>{5, 6, 9, 10, 13, 14});
  CHECK_THROWS_AS(object_window(std::vector<float>(16, 0.0F), 4), UsageError);
}
