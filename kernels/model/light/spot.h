/* A point that shines into a cone: alike up to the angle beam_width from the axis, from there falling linearly with the
 * angle to 0 at cutoff_angle.
 *
 *   irradiance at right angles = intensity / d^2 * min(1, (cutoff_angle - angle) / (cutoff_angle - beam_width))
 *
 * intensity [power / sr], d: distance [scene unit]. Agrees with Mitsuba 3's "spot" without a texture.
 * Tests: tests/model/lights_test.cpp */
#ifndef ITN_LIGHT_SPOT_H
#define ITN_LIGHT_SPOT_H
#include "model/angle.h"
#include "model/light/point.h"

#define SPOT_NUMBERS(NUMBER)                              \
  NUMBER(SPOT, intensity, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(SPOT, position_x, 1, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(SPOT, position_y, 1, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(SPOT, position_z, 1, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(SPOT, axis_x, 1, ROLE_FIXED, COORDINATE_LOG)     \
  NUMBER(SPOT, axis_y, 1, ROLE_FIXED, COORDINATE_LOG)     \
  NUMBER(SPOT, axis_z, 1, ROLE_FIXED, COORDINATE_LOG)     \
  NUMBER(SPOT, cutoff, 1, ROLE_FIXED, COORDINATE_LOG)     \
  NUMBER(SPOT, steepness, 1, ROLE_FIXED, COORDINATE_LOG)
#define SPOT_PARAMETERS(PARAMETER)                  \
  PARAMETER(intensity, EMISSION, 1, "")             \
  PARAMETER(position, ORIGIN, 0, "scene unit")      \
  PARAMETER(axis, AXIS, 0, "")                      \
  PARAMETER(cutoff_angle, HALF_ANGLE, 20, "degree") \
  PARAMETER(beam_width, BEAM, 15, "degree")
#define SPOT_TRAITS 0
enum { SPOT_NUMBERS(DECLARE_SLOT) SPOT_SLOTS };

MODEL_VOID spot_arrives(const REAL* n, REAL3 from, REAL3 on, REAL3 normal, REAL3* towards, REAL* distance,
                        REAL* share) {
  point_direction(from, make3(n[SPOT_position_x], n[SPOT_position_y], n[SPOT_position_z]), towards, distance);
  REAL angle = angle_between(scale3(*towards, NUMBER(-1)), make3(n[SPOT_axis_x], n[SPOT_axis_y], n[SPOT_axis_z]));
  REAL inside = MIN(MAX((n[SPOT_cutoff] - angle) * n[SPOT_steepness], NUMBER(0)), NUMBER(1));
  *share = inside / (*distance * *distance);
}

#ifndef __OPENCL_VERSION__
/* steepness: finite where the beam is as wide as the cone */
MODEL_VOID spot_numbers(const REAL* parameters, REAL* n) {
  for (int i = 0; i < 9; ++i) n[i] = parameters[i];
  n[SPOT_cutoff] = parameters[9] * REAL(PI_ / 180);
  n[SPOT_steepness] = REAL(1) / larger((parameters[9] - parameters[10]) * REAL(PI_ / 180), REAL(1e-6));
}
inline const char* spot_obstacle(const double*, int) { return differentiable; }
#endif

#endif
