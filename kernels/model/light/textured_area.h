/* A shape that shines as its texture `radiance` says at each of its points, alike in all directions, times `scale`, which is
 * ours. Agrees with Mitsuba 3's "area" with a texture.
 * Tests: tests/model/lights_test.cpp, tests/transport/emission_test.cpp */
#ifndef ITN_LIGHT_TEXTURED_AREA_H
#define ITN_LIGHT_TEXTURED_AREA_H
#include "model/light/area.h"

#define TEXTURED_AREA_NUMBERS(NUMBER)                           \
  NUMBER(TEXTURED_AREA, colour, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(TEXTURED_AREA, radiance, 3, ROLE_TINT, COORDINATE_LOG)
#define TEXTURED_AREA_PARAMETERS(PARAMETER) \
  PARAMETER(scale, NON_NEGATIVE, 1, "")     \
  PARAMETER(radiance, LIGHT_TINT, 1, "")
#define TEXTURED_AREA_TRAITS (LIGHT_ON_SHAPE | LIGHT_TINTED)
enum { TEXTURED_AREA_NUMBERS(DECLARE_SLOT) TEXTURED_AREA_SLOTS };

MODEL_VOID textured_area_arrives(const REAL* n, REAL3 from, REAL3 on, REAL3 normal, REAL3* towards, REAL* distance,
                                 REAL* share, REAL* uv) {
  area_arrives(n, from, on, normal, towards, distance, share, uv);
}

#ifndef __OPENCL_VERSION__
MODEL_VOID textured_area_numbers(const REAL* parameters, REAL* n) {
  for (int c = 0; c < 3; ++c) {
    n[TEXTURED_AREA_colour + c] = parameters[0];
    n[TEXTURED_AREA_radiance + c] = parameters[1 + c];
  }
}
inline const char* textured_area_obstacle(const double*, int) { return differentiable; }
#endif

#endif
