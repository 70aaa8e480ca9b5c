#include "runtime/scene/box.h"

#include <algorithm>
#include <cmath>

namespace itn {

void Box::add(const std::array<float, 3>& point) {
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], point[k]);
    high[k] = std::max(high[k], point[k]);
  }
}

void Box::add(const Box& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], other.low[k]);
    high[k] = std::max(high[k], other.high[k]);
  }
}

float Box::longest_side() const { return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}); }

float Box::half_area() const {
  const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
  return x < 0 ? 0 : x * y + y * z + z * x;
}

Box box_of(const Mesh& mesh) {
  Box box;
  for (const auto& p : mesh.position) box.add(p);
  return box;
}

Box box_of(const Shape& shape) {
  if (shape.kind == Shape::Kind::mesh) return box_of(*shape.mesh);
  Box box;
  for (std::size_t k = 0; k < 3; ++k) {
    const double extent =
        shape.kind == Shape::Kind::sphere ? shape.radius : std::hypot(shape.edge_u[k], shape.edge_v[k]);
    box.low[k] = static_cast<float>(shape.center[k] - extent);
    box.high[k] = static_cast<float>(shape.center[k] + extent);
    if (shape.kind == Shape::Kind::cylinder) {
      box.low[k] = static_cast<float>(shape.center[k] - extent + std::min(shape.axis[k], 0.0));
      box.high[k] = static_cast<float>(shape.center[k] + extent + std::max(shape.axis[k], 0.0));
    }
  }
  return box;
}

}  // namespace itn
