/* A camera the other way round: it throws the picture `irradiance` into its field of view.
 *
 *   irradiance at right angles = pi scale irradiance(u, v) d / z^3
 *
 * z: of the point in the projector's frame, d: its distance [scene unit]; (u, v): where the line to the point goes through the
 * picture, (0.5, 0.5) on the axis. So a wall at right angles to the axis shows the picture undarkened. Agrees with Mitsuba 3's "projector".
 * Tests: tests/model/lights_test.cpp */
#ifndef ITN_LIGHT_PROJECTOR_H
#define ITN_LIGHT_PROJECTOR_H
#include "model/light/point.h"

#define PROJECTOR_NUMBERS(NUMBER)                              \
  NUMBER(PROJECTOR, colour, 3, ROLE_FACTOR, COORDINATE_LOG)    \
  NUMBER(PROJECTOR, irradiance, 3, ROLE_TINT, COORDINATE_LOG)  \
  LIGHT_AXIS(NUMBER, PROJECTOR, left)                          \
  LIGHT_AXIS(NUMBER, PROJECTOR, up)                            \
  LIGHT_AXIS(NUMBER, PROJECTOR, axis)                          \
  LIGHT_AXIS(NUMBER, PROJECTOR, position)                      \
  NUMBER(PROJECTOR, half_width, 1, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(PROJECTOR, half_height, 1, ROLE_FIXED, COORDINATE_LOG)
#define PROJECTOR_PARAMETERS(PARAMETER)        \
  PARAMETER(scale, NON_NEGATIVE, 1, "")        \
  PARAMETER(irradiance, LIGHT_TINT, 1, "")     \
  PARAMETER(left, AXIS_X, 0, "")               \
  PARAMETER(up, AXIS_Y, 0, "")                 \
  PARAMETER(axis, AXIS_Z, 0, "")               \
  PARAMETER(position, ORIGIN, 0, "scene unit") \
  PARAMETER(fov, FIELD_OF_VIEW, 0, "degree")   \
  PARAMETER(aspect, PICTURE_ASPECT, 1, "")
#define PROJECTOR_TRAITS LIGHT_TINTED
enum { PROJECTOR_NUMBERS(DECLARE_SLOT) PROJECTOR_SLOTS };

MODEL_VOID projector_arrives(const REAL* n, REAL3 from, REAL3 on, REAL3 normal, REAL3* towards, REAL* distance,
                             REAL* share, REAL* uv) {
  point_direction(from, make3(n[PROJECTOR_position_x], n[PROJECTOR_position_y], n[PROJECTOR_position_z]), towards,
                  distance);
  REAL3 seen = light_local(n + PROJECTOR_left_x, scale3(*towards, NUMBER(-1)));
  REAL z = MAX(seen.z, NUMBER(1e-6));
  REAL x = seen.x / (z * n[PROJECTOR_half_width]), y = seen.y / (z * n[PROJECTOR_half_height]);
  uv[0] = NUMBER(0.5) - NUMBER(0.5) * x;
  uv[1] = NUMBER(0.5) - NUMBER(0.5) * y;
  MASK inside = (seen.z > NUMBER(1e-6)) & (ABS(x) < NUMBER(1)) & (ABS(y) < NUMBER(1));
  *share = SELECT(inside, NUMBER(PI_) / (z * z * z * *distance * *distance), NUMBER(0));
}

#ifndef __OPENCL_VERSION__
MODEL_VOID projector_numbers(const REAL* parameters, REAL* n) {
  for (int c = 0; c < 3; ++c) n[PROJECTOR_colour + c] = parameters[0];
  for (int i = PROJECTOR_irradiance; i < PROJECTOR_half_width; ++i) n[i] = parameters[i - 2];
  REAL half = parameters[PROJECTOR_half_width - 2] * REAL(PI_ / 360);
  n[PROJECTOR_half_width] = sin(half) / cos(half);
  n[PROJECTOR_half_height] = n[PROJECTOR_half_width] / parameters[PROJECTOR_half_height - 2];
}
inline const char* projector_obstacle(const double*, int) { return differentiable; }
#endif

#endif
