// The place of a mesh that is nearest to a point.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "itn/scene.h"

namespace itn {

// A hierarchy of boxes over the triangles of a mesh, which must outlive it and has at least one triangle.
class NearestPoint {
 public:
  explicit NearestPoint(const Mesh& mesh);

  struct Place {
    std::size_t triangle = 0;
    double b = 0, c = 0;  // (1 - b - c) of its first corner, b of its second and c of its third
    double distance = 0;  // [scene unit]
  };
  Place operator()(const Vec3& point) const;

 private:
  struct Node {
    Vec3 low, high;
    std::size_t first = 0, count = 0;  // of the order; 0: its children are the next node and `second`
    std::size_t second = 0;
  };
  std::size_t build(std::size_t first, std::size_t count);

  const Mesh& mesh_;
  std::vector<std::uint32_t> order_;  // of triangles
  std::vector<Node> nodes_;
};

}  // namespace itn
