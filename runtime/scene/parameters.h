// The numbers of a scene that an image depends on smoothly, by name.
#pragma once
#include <string>
#include <vector>

#include "runtime/scene/scene.h"

namespace itn {

struct Parameter {
  std::string name;  // <id>.<parameter>, with .R .G .B where the components differ or were given as <rgb>
  double value = 0;
  double low = 0, high = 0;  // the valid range; may be infinite
  bool low_included = true, high_included = true;
  std::string unit;  // empty: a pure number
  // Empty: the renderer can differentiate by it; else why not and, where there is one, the remedy.
  std::string not_differentiable;

  std::string range() const;  // "[0, 1]", "(-1, 1)", "[0, inf)"
};

// Media, phase functions, BSDFs, then the environment, in the order of the scene.
std::vector<Parameter> list_parameters(const Scene& scene);

}  // namespace itn
