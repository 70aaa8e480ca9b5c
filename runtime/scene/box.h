// Boxes along the axes.
#pragma once
#include <array>

#include "itn/scene.h"

namespace itn {

struct Box {
  std::array<float, 3> low{1e30f, 1e30f, 1e30f}, high{-1e30f, -1e30f, -1e30f};
  void add(const std::array<float, 3>& point);
  void add(const Box& other);
  float longest_side() const;  // below 0 when empty
  float half_area() const;     // 0 when empty
};

Box box_of(const Mesh& mesh);
Box box_of(const Shape& shape);

}  // namespace itn
