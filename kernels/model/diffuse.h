/* Diffuse (Lambert) reflection
 *
 *   f |cos wo| = albedo / pi max(wo.z, 0)  [1/sr]
 *
 * wo: unit, leaves the surface, in its frame (z: normal). albedo in [0, 1]. The sampler's density is max(wo.z, 0) / pi,
 * so a sample's weight is albedo.
 * Tests: tests/model/diffuse_test.cpp */
#ifndef ITN_DIFFUSE_H
#define ITN_DIFFUSE_H
#include "shared/portable.h"

MODEL diffuse_pdf(REAL3 wo) { return MAX(wo.z, NUMBER(0)) * NUMBER(1 / PI_); }

MODEL diffuse_eval(REAL albedo, REAL3 wo) { return albedo * diffuse_pdf(wo); }

MODEL3 diffuse_sample(REAL u1, REAL u2) {
  REAL s, c;
  sin_cos_2pi(u1, &s, &c);
  REAL radius = SQRT(u2);
  return make3(radius * c, radius * s, SQRT(NUMBER(1) - u2));
}

#endif
