/* Smooth metal: a mirror of reflectance F specular_reflectance.
 *
 * F: of a conductor of index eta + i k, a channel each (fresnel_conductor.h). wi, wo: unit, leave the surface, in
 * its frame. Agrees with Mitsuba 3's "conductor".
 * Tests: tests/model/bsdfs_test.cpp */
#ifndef ITN_CONDUCTOR_H
#define ITN_CONDUCTOR_H
#include "model/bsdf/reflection.h"
#include "model/fresnel_conductor.h"
#include "model/obstacle.h"

#define CONDUCTOR_NUMBERS(NUMBER)                                         \
  NUMBER(CONDUCTOR, specular_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(CONDUCTOR, eta, 3, ROLE_FACTOR, COORDINATE_LOG)                  \
  NUMBER(CONDUCTOR, k, 3, ROLE_FACTOR, COORDINATE_LOG)
#define CONDUCTOR_PARAMETERS(PARAMETER)               \
  PARAMETER(specular_reflectance, REFLECTANCE, 1, "") \
  PARAMETER(eta, METAL_INDEX, 0, "")                  \
  PARAMETER(k, METAL_INDEX, 1, "")
#define CONDUCTOR_TRAITS BSDF_SMOOTH
#define CONDUCTOR_RANDOM 0
enum { CONDUCTOR_NUMBERS(DECLARE_SLOT) CONDUCTOR_SLOTS };

MODEL_VOID conductor_chosen(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    f[c] = n[CONDUCTOR_specular_reflectance + c] *
           fresnel_conductor(MIN(ABS(wi.z), NUMBER(1)), n[CONDUCTOR_eta + c], n[CONDUCTOR_k + c]);
}

MODEL_VOID conductor_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                          REAL* inverse_eta) {
  *wo = make3(-wi.x, -wi.y, wi.z);
  *pdf = NUMBER(0);
  *inverse_eta = NUMBER(1);
  conductor_chosen(variant, n, wi, *wo, weight);
}

BSDF_CHOOSES_ALL(conductor)
BSDF_DECIDES_DIRECTION(conductor)

#ifndef __OPENCL_VERSION__
MODEL_VOID conductor_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int k = 0; k < 9; ++k) n[k] = parameters[k];
}
inline Refusal conductor_refusal(const double*) { return {}; }
inline const char* conductor_obstacle(const double* parameters, int slot) {
  if (slot > 2 && parameters[slot] == 0) return "0: gradients are by its logarithm; start from a small value";
  return unless_zero(parameters[slot]);
}
#endif

#endif
