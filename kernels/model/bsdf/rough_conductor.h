/* Rough metal: reflection at microfacets.
 *
 *   f = F D G / (4 wi.z wo.z),  h ~ wi + wo,  G = G1(wi) G1(wo);  0 unless both directions are above the surface
 *
 * f [1/sr]. F: reflectance of a conductor of index eta + i k, a channel each (fresnel_conductor.h), times
 * specular_reflectance. wi, wo: unit, leave the surface, in its frame. alpha > 0, D and G1: microfacet.h; the variants are
 * the distributions. Agrees with Mitsuba 3's "roughconductor" (visible normals, isotropic).
 *   Walter, Marschner, Li, Torrance 2007, "Microfacet models for refraction through rough surfaces"
 * Tests: tests/model/bsdfs_test.cpp */
#ifndef ITN_ROUGH_CONDUCTOR_H
#define ITN_ROUGH_CONDUCTOR_H
#include "model/bsdf/reflection.h"
#include "model/fresnel_conductor.h"
#include "model/microfacet_reflection.h"
#include "model/obstacle.h"

#define ROUGH_CONDUCTOR_NUMBERS(NUMBER)                           \
  NUMBER(ROUGH_CONDUCTOR, alpha, 1, ROLE_DENSITY, COORDINATE_LOG) \
  NUMBER(ROUGH_CONDUCTOR, eta, 3, ROLE_FACTOR, COORDINATE_LOG)    \
  NUMBER(ROUGH_CONDUCTOR, k, 3, ROLE_FACTOR, COORDINATE_LOG)      \
  NUMBER(ROUGH_CONDUCTOR, specular_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG)
#define ROUGH_CONDUCTOR_PARAMETERS(PARAMETER)  \
  PARAMETER(alpha, ROUGHNESS_TEXTURE, 0.1, "") \
  PARAMETER(eta, METAL_INDEX, 0, "")           \
  PARAMETER(k, METAL_INDEX, 1, "")             \
  PARAMETER(specular_reflectance, REFLECTANCE, 1, "")
#define ROUGH_CONDUCTOR_TRAITS 0
#define ROUGH_CONDUCTOR_RANDOM 2
enum { ROUGH_CONDUCTOR_NUMBERS(DECLARE_SLOT) ROUGH_CONDUCTOR_SLOTS };

MODEL rough_conductor_reflectance(const REAL* n, int c, REAL cosine) {
  return n[ROUGH_CONDUCTOR_specular_reflectance + c] *
         fresnel_conductor(cosine, n[ROUGH_CONDUCTOR_eta + c], n[ROUGH_CONDUCTOR_k + c]);
}

MODEL rough_conductor_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  return reflection_density(variant, n[ROUGH_CONDUCTOR_alpha], wi, wo);
}

MODEL_VOID rough_conductor_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL value =
      rough_conductor_density(variant, n, wi, wo) * microfacet_shadowing(variant, wo, n[ROUGH_CONDUCTOR_alpha]);
  REAL cosine = reflection_cosine(wi, wo);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) f[c] = value * rough_conductor_reflectance(n, c, cosine);
}

/* A visible normal m, and the mirror image of wi at it: f / pdf = F G1(wo), 0 where that is below the surface. */
MODEL_VOID rough_conductor_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                                REAL* inverse_eta) {
  REAL cosine;
  *wo = reflection_sample(variant, n[ROUGH_CONDUCTOR_alpha], wi, u[0], u[1], &cosine);
  *pdf = rough_conductor_density(variant, n, wi, *wo);
  *inverse_eta = NUMBER(1);
  REAL seen = SELECT((*pdf > NUMBER(0)) & (cosine > NUMBER(0)),
                     microfacet_shadowing(variant, *wo, n[ROUGH_CONDUCTOR_alpha]), NUMBER(0));
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] = seen * rough_conductor_reflectance(n, c, MIN(ABS(cosine), NUMBER(1)));
}

BSDF_DECIDES_DIRECTION(rough_conductor)
BSDF_DRAWS_ALL(rough_conductor)

#ifndef __OPENCL_VERSION__
MODEL_VOID rough_conductor_numbers(int variant, const REAL* parameters, REAL* n) {
  n[ROUGH_CONDUCTOR_alpha] = larger(parameters[0], REAL(least_alpha));
  for (int c = 0; c < 9; ++c) n[ROUGH_CONDUCTOR_eta + c] = parameters[1 + c];
}
inline Refusal rough_conductor_refusal(const double*) { return {}; }
inline const char* rough_conductor_obstacle(const double* parameters, int slot) {
  if (slot == 0) return parameters[0] < least_alpha ? "alpha below 0.0001 is rendered as 0.0001" : differentiable;
  if (slot < 7 && parameters[slot] == 0) return "0: gradients are by its logarithm; start from a small value";
  return unless_zero(parameters[slot]);
}
#endif

#endif
