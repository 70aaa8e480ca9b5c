/* A shape that shines: `radiance` from every point of its front, alike in all directions.
 * Agrees with Mitsuba 3's "area" without a texture; the front is that of the surface, not of interpolated normals.
 * Tests: tests/model/lights_test.cpp */
#ifndef ITN_LIGHT_AREA_H
#define ITN_LIGHT_AREA_H
#include "model/light/point.h"

#define AREA_NUMBERS(NUMBER) NUMBER(AREA, radiance, 3, ROLE_FACTOR, COORDINATE_LOG)
#define AREA_PARAMETERS(PARAMETER) PARAMETER(radiance, EMISSION, 1, "")
#define AREA_TRAITS LIGHT_ON_SHAPE
enum { AREA_NUMBERS(DECLARE_SLOT) AREA_SLOTS };

MODEL_VOID area_arrives(const REAL* n, REAL3 from, REAL3 on, REAL3 normal, REAL3* towards, REAL* distance, REAL* share,
                        REAL* uv) {
  point_direction(from, on, towards, distance);
  *share = SELECT(dot3(*towards, normal) < NUMBER(0), NUMBER(1), NUMBER(0));
}

#ifndef __OPENCL_VERSION__
MODEL_VOID area_numbers(const REAL* parameters, REAL* n) {
  for (int i = 0; i < 3; ++i) n[i] = parameters[i];
}
inline const char* area_obstacle(const double*, int) { return differentiable; }
#endif

#endif
