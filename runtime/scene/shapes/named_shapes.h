// The ten shapes of the data set.
#pragma once
#include <string>
#include <vector>

#include "runtime/scene/shapes/solid.h"

namespace itn {

struct NamedShape {
  std::string name;
  bool for_testing;  // else for training
  Solid (*solid)();

  // 80,000 triangles or so, as shape_mesh() makes them: resting on z = 0, longest side 1.
  Mesh mesh() const;
};

// Six for training, then four for testing; always the same.
const std::vector<NamedShape>& named_shapes();

}  // namespace itn
