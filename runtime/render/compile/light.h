// The lights of a scene in the form in which the device reads them (kernels/shared/light_layout.h).
#pragma once
#include <vector>

#include "itn/scene.h"

namespace itn {

// The surfaces of a shape that emit.
struct LightSurfaces {
  std::vector<float> table;  // as light_layout.h says
  int count = 0;
  double area = 0;       // [scene unit^2]
  Vec3 middle{0, 0, 0};  // of its surfaces by area
  Vec3 normal{0, 0, 0};  // mean of its surfaces by area: near 0 where they face all directions
};

// offset: how far in front of the surface connections end [scene unit].
LightSurfaces light_surfaces(const Shape& shape, double offset, int first_primitive = 0);

// Roughly the irradiance that a light brings to the box, as luminance: the mean over steps^3 of its places. surfaces:
// of a light that is a shape, else null.
double expected_irradiance(const Light& light, const LightSurfaces* surfaces, const Vec3& low, const Vec3& high,
                           int steps);

}  // namespace itn
