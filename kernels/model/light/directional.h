/* Parallel light from infinity: `irradiance` at right angles, everywhere. direction: in which it travels.
 * Agrees with Mitsuba 3's "directional".
 * Tests: tests/model/lights_test.cpp */
#ifndef ITN_LIGHT_DIRECTIONAL_H
#define ITN_LIGHT_DIRECTIONAL_H
#include "model/obstacle.h"
#include "shared/declaration.h"

#define DIRECTIONAL_NUMBERS(NUMBER)                               \
  NUMBER(DIRECTIONAL, irradiance, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(DIRECTIONAL, direction_x, 1, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(DIRECTIONAL, direction_y, 1, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(DIRECTIONAL, direction_z, 1, ROLE_FIXED, COORDINATE_LOG)
#define DIRECTIONAL_PARAMETERS(PARAMETER) \
  PARAMETER(irradiance, EMISSION, 1, "")  \
  PARAMETER(direction, DIRECTION, 0, "")
#define DIRECTIONAL_TRAITS LIGHT_PARALLEL
enum { DIRECTIONAL_NUMBERS(DECLARE_SLOT) DIRECTIONAL_SLOTS };

MODEL_VOID directional_arrives(const REAL* n, REAL3 from, REAL3 on, REAL3 normal, REAL3* towards, REAL* distance,
                               REAL* share, REAL* uv) {
  *towards = make3(-n[DIRECTIONAL_direction_x], -n[DIRECTIONAL_direction_y], -n[DIRECTIONAL_direction_z]);
  *distance = NUMBER(FAR_AWAY);
  *share = NUMBER(1);
}

#ifndef __OPENCL_VERSION__
MODEL_VOID directional_numbers(const REAL* parameters, REAL* n) {
  for (int i = 0; i < 6; ++i) n[i] = parameters[i];
}
inline const char* directional_obstacle(const double*, int) { return differentiable; }
#endif

#endif
