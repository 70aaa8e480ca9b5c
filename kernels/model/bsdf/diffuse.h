/* Diffuse (Lambert) reflection
 *
 *   f |cos wo| = albedo / pi max(wo.z, 0)  [1/sr]
 *
 * wo: unit, leaves the surface, in its frame (z: normal). albedo in [0, 1]. The sampler's density is max(wo.z, 0) / pi,
 * so a sample's weight is albedo.
 * Tests: tests/model/diffuse_test.cpp */
#ifndef ITN_DIFFUSE_H
#define ITN_DIFFUSE_H
#include "model/bsdf/reflection.h"
#include "model/obstacle.h"

#define DIFFUSE_NUMBERS(NUMBER) NUMBER(DIFFUSE, reflectance, 3, ROLE_FACTOR, COORDINATE_LOG)
#define DIFFUSE_PARAMETERS(PARAMETER) PARAMETER(reflectance, REFLECTANCE, 0.5, "")
#define DIFFUSE_TRAITS BSDF_EVEN
#define DIFFUSE_RANDOM 2
enum { DIFFUSE_NUMBERS(DECLARE_SLOT) DIFFUSE_SLOTS };

MODEL diffuse_pdf(REAL3 wo) { return MAX(wo.z, NUMBER(0)) * NUMBER(1 / PI_); }

MODEL diffuse_eval(REAL albedo, REAL3 wo) { return albedo * diffuse_pdf(wo); }

MODEL3 diffuse_sample(REAL u1, REAL u2) {
  REAL s, c;
  sin_cos_2pi(u1, &s, &c);
  REAL radius = SQRT(u2);
  return make3(radius * c, radius * s, SQRT(NUMBER(1) - u2));
}

MODEL_VOID diffuse_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) f[c] = diffuse_eval(n[DIFFUSE_reflectance + c], wo);
}

MODEL diffuse_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) { return diffuse_pdf(wo); }

MODEL_VOID diffuse_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                        REAL* inverse_eta) {
  *wo = diffuse_sample(u[0], u[1]);
  *pdf = diffuse_pdf(*wo);
  *inverse_eta = NUMBER(1);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) weight[c] = n[DIFFUSE_reflectance + c];
}

BSDF_DECIDES_DIRECTION(diffuse)
BSDF_DRAWS_ALL(diffuse)

#ifndef __OPENCL_VERSION__
MODEL_VOID diffuse_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int c = 0; c < 3; ++c) n[c] = parameters[c];
}
inline Refusal diffuse_refusal(const double*) { return {}; }
inline const char* diffuse_obstacle(const double* parameters, int slot) { return unless_zero(parameters[slot]); }
#endif

#endif
