// Positions of lights relative to bodies that refract, and so how paths in these find them
// (kernels/shared/light_layout.h).
#pragma once
#include <vector>

#include "itn/scene.h"
#include "runtime/render/compile/light.h"
#include "runtime/scene/box.h"

namespace itn {

class RefractingBodies {
 public:
  // The scene must outlive it.
  explicit RefractingBodies(const Scene& scene);

  // LIGHT_AT_BOUNDARIES ...; shape and surfaces: of a light that is a shape, else null
  int reach(const Light& light, const Shape* shape, const LightSurfaces* surfaces) const;

  // Is there a rough surface with two sides but no inside, a pane: then any light may stand behind it.
  bool has_panes() const { return has_panes_; }

 private:
  struct Body {
    const Shape* shape;
    Box box;
  };
  bool hold(const std::vector<Vec3>& points) const;

  std::vector<Body> bodies_;
  bool has_panes_ = false;
};

}  // namespace itn
