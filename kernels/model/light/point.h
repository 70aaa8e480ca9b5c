/* A point that shines alike in all directions.
 *
 *   irradiance at right angles = intensity / d^2
 *
 * intensity [power / sr], d: distance [scene unit]. Agrees with Mitsuba 3's "point".
 * Tests: tests/model/lights_test.cpp */
#ifndef ITN_LIGHT_POINT_H
#define ITN_LIGHT_POINT_H
#include "model/obstacle.h"
#include "shared/declaration.h"

#define POINT_NUMBERS(NUMBER)                              \
  NUMBER(POINT, intensity, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(POINT, position_x, 1, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(POINT, position_y, 1, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(POINT, position_z, 1, ROLE_FIXED, COORDINATE_LOG)
#define POINT_PARAMETERS(PARAMETER)     \
  PARAMETER(intensity, EMISSION, 1, "") \
  PARAMETER(position, POSITION, 0, "scene unit")
#define POINT_TRAITS 0
/* Numbers of an axis. */
#define LIGHT_AXIS(NUMBER, PREFIX, axis)                  \
  NUMBER(PREFIX, axis##_x, 1, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(PREFIX, axis##_y, 1, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(PREFIX, axis##_z, 1, ROLE_FIXED, COORDINATE_LOG)
enum { POINT_NUMBERS(DECLARE_SLOT) POINT_SLOTS };

/* From `from` to `to`: the unit direction and the distance. A point on itself gets some direction. */
MODEL_VOID point_direction(REAL3 from, REAL3 to, REAL3* towards, REAL* distance) {
  REAL3 d = sub3(to, from);
  *distance = SQRT(MAX(dot3(d, d), NUMBER(1e-30)));
  *towards = scale3(d, NUMBER(1) / *distance);
}

MODEL_VOID point_arrives(const REAL* n, REAL3 from, REAL3 on, REAL3 normal, REAL3* towards, REAL* distance, REAL* share,
                         REAL* uv) {
  point_direction(from, make3(n[POINT_position_x], n[POINT_position_y], n[POINT_position_z]), towards, distance);
  *share = NUMBER(1) / (*distance * *distance);
}

/* The vector v in the frame of the numbers axes[0..8]: x, y and z axis. */
MODEL3 light_local(const REAL* axes, REAL3 v) {
  return make3(dot3(v, make3(axes[0], axes[1], axes[2])), dot3(v, make3(axes[3], axes[4], axes[5])),
               dot3(v, make3(axes[6], axes[7], axes[8])));
}

#ifndef __OPENCL_VERSION__
MODEL_VOID point_numbers(const REAL* parameters, REAL* n) {
  for (int i = 0; i < 6; ++i) n[i] = parameters[i];
}
inline const char* point_obstacle(const double*, int) { return differentiable; }
#endif

#endif
