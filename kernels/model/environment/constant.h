/* Light of the same radiance from everywhere.
 *
 * radiance [power / (area sr)]. Agrees with Mitsuba 3's "constant".
 * Tests: tests/kernel/environment_test.cpp */
#ifndef ITN_ENVIRONMENT_CONSTANT_H
#define ITN_ENVIRONMENT_CONSTANT_H
#include "shared/environment_layout.h"

#define CONSTANT_PARAMETERS(PARAMETER) PARAMETER(radiance, EMISSION, 1, "")
#define CONSTANT_TRAITS ENVIRONMENT_EVEN
#define CONSTANT_FORMULA ""

#ifdef __OPENCL_VERSION__
#include "shared/vector.h"

static inline void constant_radiance(__global const EnvironmentRecord* record, __global const float* tables, REAL3 d,
                                     REAL rgb[3]) {
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = record->radiance[c];
}

static inline void constant_derivative(__global const EnvironmentRecord* record,
                                       __global const EnvironmentRecord* moving, __global const float* tables, REAL3 d,
                                       REAL rgb[3]) {
  constant_radiance(moving, tables, d, rgb);
}

static inline REAL constant_pdf(__global const EnvironmentRecord* record, __global const float* tables, REAL3 d) {
  return (REAL)(float)(1 / (4 * PI_));
}

static inline REAL3 constant_sample(__global const EnvironmentRecord* record, __global const float* tables, REAL u0,
                                    REAL u1, REAL* pdf) {
  *pdf = (REAL)(float)(1 / (4 * PI_));
  return uniform_sphere(u0, u1);
}
#endif

#endif
