/* Thin pane of a dielectric: light is reflected or passes straight on. With F the reflectance of one of its two
 * sides, what goes to and fro between them sums up to
 *
 *   reflected  2 F / (1 + F) specular_reflectance,  passed  (1 - F) / (1 + F) specular_transmittance
 *
 * wi, wo: unit, leave the surface, in its frame; wi on either side. eta > 0: refractive index of the pane over that
 * around it. Agrees with Mitsuba 3's "thindielectric".
 * Tests: tests/model/bsdfs_test.cpp */
#ifndef ITN_THIN_DIELECTRIC_H
#define ITN_THIN_DIELECTRIC_H
#include "model/bsdf/reflection.h"
#include "model/fresnel_dielectric.h"
#include "model/obstacle.h"

#define THIN_DIELECTRIC_NUMBERS(NUMBER)                                           \
  NUMBER(THIN_DIELECTRIC, specular_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG)   \
  NUMBER(THIN_DIELECTRIC, specular_transmittance, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(THIN_DIELECTRIC, eta, 1, ROLE_INDEX, COORDINATE_LOG)
#define THIN_DIELECTRIC_PARAMETERS(PARAMETER)           \
  PARAMETER(specular_reflectance, REFLECTANCE, 1, "")   \
  PARAMETER(specular_transmittance, REFLECTANCE, 1, "") \
  PARAMETER(int_ior, INDEX, 1.5046, "")                 \
  PARAMETER(ext_ior, INDEX, 1.000277, "")
#define THIN_DIELECTRIC_TRAITS (BSDF_TRANSMITS | BSDF_SMOOTH | BSDF_THIN)
#define THIN_DIELECTRIC_RANDOM 1
enum { THIN_DIELECTRIC_NUMBERS(DECLARE_SLOT) THIN_DIELECTRIC_SLOTS };

MODEL thin_dielectric_reflectance(const REAL* n, REAL3 wi) {
  REAL f = fresnel_dielectric(MIN(ABS(wi.z), NUMBER(1)), n[THIN_DIELECTRIC_eta]);
  return NUMBER(2) * f / (NUMBER(1) + f);
}

MODEL_VOID thin_dielectric_chosen(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL reflected = thin_dielectric_reflectance(n, wi);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    f[c] = SELECT(wi.z * wo.z > NUMBER(0), reflected * n[THIN_DIELECTRIC_specular_reflectance + c],
                  (NUMBER(1) - reflected) * n[THIN_DIELECTRIC_specular_transmittance + c]);
}

/* Reflection with the probability of reflection. */
MODEL_VOID thin_dielectric_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                                REAL* inverse_eta) {
  MASK mirror = u[0] < thin_dielectric_reflectance(n, wi);
  *wo = make3(-wi.x, -wi.y, SELECT(mirror, wi.z, -wi.z));
  *pdf = NUMBER(0);
  *inverse_eta = NUMBER(1);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] =
        SELECT(mirror, n[THIN_DIELECTRIC_specular_reflectance + c], n[THIN_DIELECTRIC_specular_transmittance + c]);
}

BSDF_CHOOSES_ALL(thin_dielectric)
BSDF_DECIDES_DIRECTION(thin_dielectric)

#ifndef __OPENCL_VERSION__
MODEL_VOID thin_dielectric_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int k = 0; k < 6; ++k) n[k] = parameters[k];
  n[THIN_DIELECTRIC_eta] = parameters[6] / parameters[7];
}
inline Refusal thin_dielectric_refusal(const double*) { return {}; }
inline const char* thin_dielectric_obstacle(const double* parameters, int slot) {
  if (slot < 6) return unless_zero(parameters[slot]);
  const double ratio = parameters[6] / parameters[7];
  if (ratio - 1 < 1e-4 && 1 - ratio < 1e-4) return "the two indices are nearly equal, and nothing is reflected";
  return ratio < 1e-3 || ratio > 1e3 ? "the ratio of the two indices is beyond 1000" : differentiable;
}
#endif

#endif
