/* Heterogeneous medium: extinction and albedo are numbers times fields, which differ from place to place (texture/field.h).
 * Along a flight from x0, with the field f and its integral, the column density t(d) = int_0^d f(x0 + s w) ds:
 *
 *   transmittance      T(d) = exp(-sigma_t t(d))                       [1]
 *   free flight        p(d) = f(x(d)) sigma_t exp(-sigma_t t(d))       [1 / scene unit]
 *
 * As functions of the numbers these are a homogeneous medium's, with t in the place of d: f at the end is no function of
 * them. Their scores are linear in t, so that an estimate of t without bias gives scores without bias.
 *
 * sigma_t >= 0 [1 / scene unit where the field is a number], t >= 0.
 * Tests: tests/kernel/field_test.cpp, tests/transport/heterogeneous_test.cpp */
#ifndef ITN_MEDIUM_HETEROGENEOUS_H
#define ITN_MEDIUM_HETEROGENEOUS_H
#include "model/medium/homogeneous.h"

#define HETEROGENEOUS_NUMBERS(NUMBER)                             \
  NUMBER(HETEROGENEOUS, sigma_t, 3, ROLE_DENSITY, COORDINATE_LOG) \
  NUMBER(HETEROGENEOUS, albedo, 3, ROLE_FACTOR, COORDINATE_LOG)
/* A grid of voxels counts as 1 here. */
#define HETEROGENEOUS_PARAMETERS(PARAMETER)                \
  PARAMETER(sigma_t, EXTINCTION_VOLUME, 1, "1/scene unit") \
  PARAMETER(albedo, ALBEDO_VOLUME, 0.75, "")               \
  PARAMETER(scale, NON_NEGATIVE, 1, "")
enum { HETEROGENEOUS_NUMBERS(DECLARE_SLOT) HETEROGENEOUS_SLOTS };

MODEL_VOID heterogeneous_scattering(const REAL* n, REAL column_density, REAL* f) {
  homogeneous_scattering(n, column_density, f);
}

MODEL_VOID heterogeneous_passage(const REAL* n, REAL column_density, REAL* f) {
  homogeneous_passage(n, column_density, f);
}

#ifndef __OPENCL_VERSION__
/* parameters: sigma_t (3), albedo (3), scale */
MODEL_VOID heterogeneous_numbers(const REAL* parameters, REAL* n) { homogeneous_numbers(parameters, n); }

inline const char* heterogeneous_obstacle(const double* parameters, int slot) {
  return homogeneous_obstacle(parameters, slot);
}
#endif

#endif
