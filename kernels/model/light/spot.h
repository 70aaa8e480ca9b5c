/* A point that shines into a cone: alike up to the angle beam_width from the axis, from there falling linearly with the
 * angle to 0 at cutoff_angle; a texture may tint the cone's cross section.
 *
 *   irradiance at right angles = intensity / d^2 * min(1, (cutoff_angle - angle) / (cutoff_angle - beam_width)) * tint
 *
 * intensity [power / sr], d: distance [scene unit]. Agrees with Mitsuba 3's "spot".
 * Tests: tests/model/lights_test.cpp */
#ifndef ITN_LIGHT_SPOT_H
#define ITN_LIGHT_SPOT_H
#include "model/angle.h"
#include "model/light/point.h"

#define SPOT_NUMBERS(NUMBER)                              \
  NUMBER(SPOT, intensity, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(SPOT, texture, 3, ROLE_TINT, COORDINATE_LOG)     \
  LIGHT_AXIS(NUMBER, SPOT, left)                          \
  LIGHT_AXIS(NUMBER, SPOT, up)                            \
  LIGHT_AXIS(NUMBER, SPOT, axis)                          \
  LIGHT_AXIS(NUMBER, SPOT, position)                      \
  NUMBER(SPOT, cutoff, 1, ROLE_FIXED, COORDINATE_LOG)     \
  NUMBER(SPOT, steepness, 1, ROLE_FIXED, COORDINATE_LOG)  \
  NUMBER(SPOT, inverse_radius, 1, ROLE_FIXED, COORDINATE_LOG)
#define SPOT_PARAMETERS(PARAMETER)                  \
  PARAMETER(intensity, EMISSION, 1, "")             \
  PARAMETER(texture, LIGHT_TINT, 1, "")             \
  PARAMETER(left, AXIS_X, 0, "")                    \
  PARAMETER(up, AXIS_Y, 0, "")                      \
  PARAMETER(axis, AXIS_Z, 0, "")                    \
  PARAMETER(position, ORIGIN, 0, "scene unit")      \
  PARAMETER(cutoff_angle, HALF_ANGLE, 20, "degree") \
  PARAMETER(beam_width, BEAM, 15, "degree")
#define SPOT_TRAITS LIGHT_TINTED
enum { SPOT_NUMBERS(DECLARE_SLOT) SPOT_SLOTS };

MODEL_VOID spot_arrives(const REAL* n, REAL3 from, REAL3 on, REAL3 normal, REAL3* towards, REAL* distance, REAL* share,
                        REAL* uv) {
  point_direction(from, make3(n[SPOT_position_x], n[SPOT_position_y], n[SPOT_position_z]), towards, distance);
  REAL3 out = scale3(*towards, NUMBER(-1));
  REAL angle = angle_between(out, make3(n[SPOT_axis_x], n[SPOT_axis_y], n[SPOT_axis_z]));
  REAL inside = MIN(MAX((n[SPOT_cutoff] - angle) * n[SPOT_steepness], NUMBER(0)), NUMBER(1));
  *share = inside / (*distance * *distance);
  REAL3 seen = light_local(n + SPOT_left_x, out);
  REAL scale = NUMBER(0.5) * n[SPOT_inverse_radius] / MAX(seen.z, NUMBER(1e-6));
  uv[0] = NUMBER(0.5) + seen.x * scale;
  uv[1] = NUMBER(0.5) + seen.y * scale;
}

#ifndef __OPENCL_VERSION__
/* steepness: finite where the beam is as wide as the cone; inverse_radius: of the cone's cross section at distance 1 */
MODEL_VOID spot_numbers(const REAL* parameters, REAL* n) {
  for (int i = 0; i < SPOT_cutoff; ++i) n[i] = parameters[i];
  n[SPOT_cutoff] = parameters[SPOT_cutoff] * REAL(PI_ / 180);
  n[SPOT_steepness] =
      REAL(1) / larger((parameters[SPOT_cutoff] - parameters[SPOT_cutoff + 1]) * REAL(PI_ / 180), REAL(1e-6));
  n[SPOT_inverse_radius] = cos(n[SPOT_cutoff]) / larger(sin(n[SPOT_cutoff]), REAL(1e-6));
}
inline const char* spot_obstacle(const double*, int) { return differentiable; }
#endif

#endif
