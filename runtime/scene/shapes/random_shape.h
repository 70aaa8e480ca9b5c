// Endless closed shapes, one for each seed.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/scene/shapes/solid.h"

namespace itn {

struct RandomShape {
  std::string family;  // one of random_families()
  Solid solid;

  // As shape_mesh() makes it: resting on z = 0, longest side 1.
  Mesh mesh(int triangles = 40000) const;
};

// The same seed gives the same shape. The family is drawn first, then its numbers, then changes that any family may get
// (a rough skin, holes, stretching), and a rotation from all rotations. None is one of the named shapes.
RandomShape random_shape(std::uint64_t seed);

const std::vector<std::string>& random_families();

}  // namespace itn
