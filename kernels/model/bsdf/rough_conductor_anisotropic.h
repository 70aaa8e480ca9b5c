/* Rough metal that was brushed or milled: rough_conductor.h with a roughness of its own along each axis of the surface.
 *
 *   f = F D G / (4 wi.z wo.z),  h ~ wi + wo,  G = G1(wi) G1(wo);  0 unless both directions are above the surface
 *
 * f [1/sr]. F: as of rough_conductor.h. alpha_u > 0 along x of the frame, which follows the first texture coordinate,
 * alpha_v > 0 along y; D and G1: microfacet_anisotropic.h. Agrees with Mitsuba 3's "roughconductor" (visible normals).
 *   Walter, Marschner, Li, Torrance 2007, "Microfacet models for refraction through rough surfaces"
 * Tests: tests/model/bsdfs_test.cpp */
#ifndef ITN_ROUGH_CONDUCTOR_ANISOTROPIC_H
#define ITN_ROUGH_CONDUCTOR_ANISOTROPIC_H
#include "model/bsdf/reflection.h"
#include "model/fresnel_conductor.h"
#include "model/microfacet_anisotropic.h"
#include "model/obstacle.h"

#define ROUGH_CONDUCTOR_ANISOTROPIC_NUMBERS(NUMBER)                             \
  NUMBER(ROUGH_CONDUCTOR_ANISOTROPIC, alpha_u, 1, ROLE_DENSITY, COORDINATE_LOG) \
  NUMBER(ROUGH_CONDUCTOR_ANISOTROPIC, alpha_v, 1, ROLE_DENSITY, COORDINATE_LOG) \
  NUMBER(ROUGH_CONDUCTOR_ANISOTROPIC, eta, 3, ROLE_FACTOR, COORDINATE_LOG)      \
  NUMBER(ROUGH_CONDUCTOR_ANISOTROPIC, k, 3, ROLE_FACTOR, COORDINATE_LOG)        \
  NUMBER(ROUGH_CONDUCTOR_ANISOTROPIC, specular_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG)
#define ROUGH_CONDUCTOR_ANISOTROPIC_PARAMETERS(PARAMETER) \
  PARAMETER(alpha_u, ROUGHNESS_TEXTURE, 0.1, "")          \
  PARAMETER(alpha_v, ROUGHNESS_TEXTURE, 0.1, "")          \
  PARAMETER(eta, METAL_INDEX, 0, "")                      \
  PARAMETER(k, METAL_INDEX, 1, "")                        \
  PARAMETER(specular_reflectance, REFLECTANCE, 1, "")
#define ROUGH_CONDUCTOR_ANISOTROPIC_TRAITS BSDF_ANISOTROPIC
#define ROUGH_CONDUCTOR_ANISOTROPIC_RANDOM 2
enum { ROUGH_CONDUCTOR_ANISOTROPIC_NUMBERS(DECLARE_SLOT) ROUGH_CONDUCTOR_ANISOTROPIC_SLOTS };

MODEL rough_conductor_anisotropic_reflectance(const REAL* n, int c, REAL cosine) {
  return n[ROUGH_CONDUCTOR_ANISOTROPIC_specular_reflectance + c] *
         fresnel_conductor(cosine, n[ROUGH_CONDUCTOR_ANISOTROPIC_eta + c], n[ROUGH_CONDUCTOR_ANISOTROPIC_k + c]);
}

MODEL rough_conductor_anisotropic_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  return anisotropic_reflection_density(variant, n[ROUGH_CONDUCTOR_ANISOTROPIC_alpha_u],
                                        n[ROUGH_CONDUCTOR_ANISOTROPIC_alpha_v], wi, wo);
}

MODEL_VOID rough_conductor_anisotropic_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL value = rough_conductor_anisotropic_density(variant, n, wi, wo) *
               anisotropic_shadowing(variant, wo, n[ROUGH_CONDUCTOR_ANISOTROPIC_alpha_u],
                                     n[ROUGH_CONDUCTOR_ANISOTROPIC_alpha_v]);
  REAL cosine = reflection_cosine(wi, wo);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) f[c] = value * rough_conductor_anisotropic_reflectance(n, c, cosine);
}

/* A visible normal m, and the mirror image of wi at it: f / pdf = F G1(wo), 0 where that is below the surface. */
MODEL_VOID rough_conductor_anisotropic_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo,
                                            REAL* weight, REAL* pdf, REAL* inverse_eta) {
  REAL cosine;
  *wo = anisotropic_reflection_sample(variant, n[ROUGH_CONDUCTOR_ANISOTROPIC_alpha_u],
                                      n[ROUGH_CONDUCTOR_ANISOTROPIC_alpha_v], wi, u[0], u[1], &cosine);
  *pdf = rough_conductor_anisotropic_density(variant, n, wi, *wo);
  *inverse_eta = NUMBER(1);
  REAL seen = SELECT((*pdf > NUMBER(0)) & (cosine > NUMBER(0)),
                     anisotropic_shadowing(variant, *wo, n[ROUGH_CONDUCTOR_ANISOTROPIC_alpha_u],
                                           n[ROUGH_CONDUCTOR_ANISOTROPIC_alpha_v]),
                     NUMBER(0));
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] = seen * rough_conductor_anisotropic_reflectance(n, c, MIN(ABS(cosine), NUMBER(1)));
}

BSDF_DECIDES_DIRECTION(rough_conductor_anisotropic)
BSDF_DRAWS_ALL(rough_conductor_anisotropic)

#ifndef __OPENCL_VERSION__
MODEL_VOID rough_conductor_anisotropic_numbers(int variant, const REAL* parameters, REAL* n) {
  n[ROUGH_CONDUCTOR_ANISOTROPIC_alpha_u] = larger(parameters[0], REAL(least_alpha));
  n[ROUGH_CONDUCTOR_ANISOTROPIC_alpha_v] = larger(parameters[1], REAL(least_alpha));
  for (int c = 0; c < 9; ++c) n[ROUGH_CONDUCTOR_ANISOTROPIC_eta + c] = parameters[2 + c];
}
inline Refusal rough_conductor_anisotropic_refusal(const double*) { return {}; }
inline const char* rough_conductor_anisotropic_obstacle(const double* parameters, int slot) {
  if (slot < 2) return parameters[slot] < least_alpha ? "alpha below 0.0001 is rendered as 0.0001" : differentiable;
  if (slot < 8 && parameters[slot] == 0) return "0: gradients are by its logarithm; start from a small value";
  return unless_zero(parameters[slot]);
}
#endif

#endif
