// Where lights stand beside bodies that refract, and so how paths in these find them (kernels/shared/light_layout.h).
#pragma once
#include <vector>

#include "runtime/scene/box.h"
#include "runtime/scene/scene.h"

namespace itn {

class RefractingBodies {
 public:
  explicit RefractingBodies(const Scene& scene);

  // LIGHT_INSIDE where the light's box meets that of a body, which is not more than a guess: a light that is called
  // inside is found from everywhere, one that is not must stand outside. shape: of a light that is one, else null.
  int reach(const Light& light, const Shape* shape) const;

  // Is there a rough surface with two sides but no inside, a pane: then any light may stand behind it.
  bool has_panes() const { return has_panes_; }

 private:
  std::vector<Box> boxes_;
  bool has_panes_ = false;
};

}  // namespace itn
