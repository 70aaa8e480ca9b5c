/* A flat shape that shines along its normal alone: a beam as wide as the shape, a laser widened, or a collimator.
 *
 *   irradiance at right angles = radiance   in front of the shape, as far as the beam is not blocked; else 0
 *
 * A point lies in the beam where its place on the shape, center + a u + b v, is in [-1, 1]^2 of a rectangle or in the unit disk; to_u and
 * to_v tell a and b. Agrees with Mitsuba 3's "directionalarea" as its `ptracer` renders it; its other integrators do not find the light.
 * `radiance` is Mitsuba's name for it.
 * Tests: tests/model/lights_test.cpp, tests/transport/mitsuba_test.cpp (beams) */
#ifndef ITN_LIGHT_DIRECTIONAL_AREA_H
#define ITN_LIGHT_DIRECTIONAL_AREA_H
#include "model/light/point.h"

#define DIRECTIONAL_AREA_NUMBERS(NUMBER)                             \
  NUMBER(DIRECTIONAL_AREA, radiance, 3, ROLE_FACTOR, COORDINATE_LOG) \
  LIGHT_AXIS(NUMBER, DIRECTIONAL_AREA, center)                       \
  LIGHT_AXIS(NUMBER, DIRECTIONAL_AREA, normal)                       \
  LIGHT_AXIS(NUMBER, DIRECTIONAL_AREA, to_u)                         \
  LIGHT_AXIS(NUMBER, DIRECTIONAL_AREA, to_v)                         \
  NUMBER(DIRECTIONAL_AREA, round, 1, ROLE_FIXED, COORDINATE_LOG)     \
  NUMBER(DIRECTIONAL_AREA, in_front, 1, ROLE_FIXED, COORDINATE_LOG)
#define DIRECTIONAL_AREA_PARAMETERS(PARAMETER) \
  PARAMETER(radiance, EMISSION, 1, "")         \
  PARAMETER(center, OF_SHAPE, 0, "scene unit") \
  PARAMETER(normal, OF_SHAPE, 0, "")           \
  PARAMETER(to_u, OF_SHAPE, 0, "")             \
  PARAMETER(to_v, OF_SHAPE, 0, "")             \
  PARAMETER(round, OF_SHAPE_NUMBER, 0, "")
#define DIRECTIONAL_AREA_TRAITS (LIGHT_BEAM | LIGHT_PARALLEL)
enum { DIRECTIONAL_AREA_NUMBERS(DECLARE_SLOT) DIRECTIONAL_AREA_SLOTS };

MODEL_VOID directional_area_arrives(const REAL* n, REAL3 from, REAL3 on, REAL3 normal, REAL3* towards, REAL* distance,
                                    REAL* share, REAL* uv) {
  REAL3 off =
      sub3(from, make3(n[DIRECTIONAL_AREA_center_x], n[DIRECTIONAL_AREA_center_y], n[DIRECTIONAL_AREA_center_z]));
  REAL3 along = make3(n[DIRECTIONAL_AREA_normal_x], n[DIRECTIONAL_AREA_normal_y], n[DIRECTIONAL_AREA_normal_z]);
  REAL a = dot3(off, make3(n[DIRECTIONAL_AREA_to_u_x], n[DIRECTIONAL_AREA_to_u_y], n[DIRECTIONAL_AREA_to_u_z]));
  REAL b = dot3(off, make3(n[DIRECTIONAL_AREA_to_v_x], n[DIRECTIONAL_AREA_to_v_y], n[DIRECTIONAL_AREA_to_v_z]));
  REAL ahead = dot3(off, along) - n[DIRECTIONAL_AREA_in_front];
  REAL out = SELECT(n[DIRECTIONAL_AREA_round] > NUMBER(0.5), a * a + b * b, MAX(ABS(a), ABS(b)));
  *towards = scale3(along, NUMBER(-1));
  *distance = MAX(ahead, NUMBER(0));
  *share = SELECT((ahead > NUMBER(0)) & (out < NUMBER(1)), NUMBER(1), NUMBER(0));
}

#ifndef __OPENCL_VERSION__
MODEL_VOID directional_area_numbers(const REAL* parameters, REAL* n) {
  for (int i = 0; i < DIRECTIONAL_AREA_in_front; ++i) n[i] = parameters[i];
  n[DIRECTIONAL_AREA_in_front] = REAL(0); /* of the whole scene: runtime/render/compile/launch_data.cpp */
}
inline const char* directional_area_obstacle(const double*, int) { return differentiable; }
#endif

#endif
