/* Rough plastic: a diffuse base under a rough dielectric coating.
 *
 *   coating  F D G / (4 wi.z) specular_reflectance,  h ~ wi + wo,  G = G1(wi) G1(wo)
 *   base     coating.h with T and R of the rough interface (rough_transmittance.h)
 *
 * f |cos wo| is their sum [1/sr]; 0 unless both directions are above the surface. wi, wo: unit, leave the surface,
 * in its frame. D, G1: microfacet.h; the variants are the distributions. Agrees with Mitsuba 3's "roughplastic".
 *   Walter, Marschner, Li, Torrance 2007, "Microfacet models for refraction through rough surfaces"
 * Tests: tests/model/plastics_test.cpp, bsdfs_test.cpp */
#ifndef ITN_ROUGH_PLASTIC_H
#define ITN_ROUGH_PLASTIC_H
#include "model/bsdf/reflection.h"
#include "model/coating.h"
#include "model/microfacet_reflection.h"
#include "model/obstacle.h"
#include "model/rough_transmittance.h"

/* eta: inside over outside; trapped: R; t0 to t7: the coefficients of T */
#define ROUGH_PLASTIC_NUMBERS(NUMBER)                                         \
  NUMBER(ROUGH_PLASTIC, diffuse_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG)  \
  NUMBER(ROUGH_PLASTIC, specular_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(ROUGH_PLASTIC, alpha, 1, ROLE_DENSITY, COORDINATE_LOG)               \
  NUMBER(ROUGH_PLASTIC, eta, 1, ROLE_INDEX, COORDINATE_LOG)                   \
  NUMBER(ROUGH_PLASTIC, nonlinear, 1, ROLE_FIXED, COORDINATE_ITSELF)          \
  NUMBER(ROUGH_PLASTIC, trapped, 1, ROLE_FACTOR, COORDINATE_ITSELF)           \
  NUMBER(ROUGH_PLASTIC, t0, 1, ROLE_FACTOR, COORDINATE_ITSELF)                \
  NUMBER(ROUGH_PLASTIC, t1, 1, ROLE_FACTOR, COORDINATE_ITSELF)                \
  NUMBER(ROUGH_PLASTIC, t2, 1, ROLE_FACTOR, COORDINATE_ITSELF)                \
  NUMBER(ROUGH_PLASTIC, t3, 1, ROLE_FACTOR, COORDINATE_ITSELF)                \
  NUMBER(ROUGH_PLASTIC, t4, 1, ROLE_FACTOR, COORDINATE_ITSELF)                \
  NUMBER(ROUGH_PLASTIC, t5, 1, ROLE_FACTOR, COORDINATE_ITSELF)                \
  NUMBER(ROUGH_PLASTIC, t6, 1, ROLE_FACTOR, COORDINATE_ITSELF)                \
  NUMBER(ROUGH_PLASTIC, t7, 1, ROLE_FACTOR, COORDINATE_ITSELF)
#define ROUGH_PLASTIC_PARAMETERS(PARAMETER)            \
  PARAMETER(diffuse_reflectance, REFLECTANCE, 0.5, "") \
  PARAMETER(specular_reflectance, REFLECTANCE, 1, "")  \
  PARAMETER(alpha, ROUGHNESS, 0.1, "")                 \
  PARAMETER(int_ior, INDEX, 1.49, "")                  \
  PARAMETER(ext_ior, INDEX, 1.000277, "")              \
  PARAMETER(nonlinear, FLAG, 0, "")
#define ROUGH_PLASTIC_TRAITS 0
#define ROUGH_PLASTIC_RANDOM 3
enum { ROUGH_PLASTIC_NUMBERS(DECLARE_SLOT) ROUGH_PLASTIC_SLOTS };

MODEL rough_plastic_passes(const REAL* n, REAL3 w) {
  return rough_transmittance(n[ROUGH_PLASTIC_alpha], n + ROUGH_PLASTIC_t0, MIN(MAX(w.z, NUMBER(0)), NUMBER(1)));
}

MODEL rough_plastic_choice(const REAL* n, REAL3 wi) {
  return coating_choice(n + ROUGH_PLASTIC_specular_reflectance, n + ROUGH_PLASTIC_diffuse_reflectance,
                        rough_plastic_passes(n, wi));
}

MODEL_VOID rough_plastic_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL alpha = n[ROUGH_PLASTIC_alpha], eta = n[ROUGH_PLASTIC_eta];
  REAL coating = reflection_density(variant, alpha, wi, wo) * microfacet_shadowing(variant, wo, alpha) *
                 fresnel_dielectric(reflection_cosine(wi, wo), eta);
  REAL passed = SELECT(wi.z > NUMBER(0), rough_plastic_passes(n, wi) * rough_plastic_passes(n, wo), NUMBER(0));
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    f[c] = coating * n[ROUGH_PLASTIC_specular_reflectance + c] + coating_base(n[ROUGH_PLASTIC_diffuse_reflectance + c],
                                                                              passed, eta, n[ROUGH_PLASTIC_trapped],
                                                                              n[ROUGH_PLASTIC_nonlinear], wo);
}

MODEL rough_plastic_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  REAL choice = rough_plastic_choice(n, wi);
  REAL density =
      choice * reflection_density(variant, n[ROUGH_PLASTIC_alpha], wi, wo) + (NUMBER(1) - choice) * diffuse_pdf(wo);
  return SELECT(wi.z > NUMBER(0), density, NUMBER(0));
}

/* Draws from the coating if u0 is below its probability; the sample is lost if its mirror image is below the
 * surface. */
MODEL_VOID rough_plastic_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                              REAL* inverse_eta) {
  MASK from_coating = u[0] < rough_plastic_choice(n, wi);
  REAL cosine;
  REAL3 mirrored = reflection_sample(variant, n[ROUGH_PLASTIC_alpha], wi, u[1], u[2], &cosine);
  REAL3 from_base = diffuse_sample(u[1], u[2]);
  *wo = make3(SELECT(from_coating, mirrored.x, from_base.x), SELECT(from_coating, mirrored.y, from_base.y),
              SELECT(from_coating, mirrored.z, from_base.z));
  *pdf = SELECT(wo->z > NUMBER(0), rough_plastic_density(variant, n, wi, *wo), NUMBER(0));
  *inverse_eta = NUMBER(1);
  REAL f[CHANNELS];
  rough_plastic_value(variant, n, wi, *wo, f);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] = SELECT(*pdf > NUMBER(0), f[c] / MAX(*pdf, NUMBER(1e-20)), NUMBER(0));
}

BSDF_DECIDES_DIRECTION(rough_plastic)
BSDF_DRAWS_ALL(rough_plastic)

#ifndef __OPENCL_VERSION__
MODEL_VOID rough_plastic_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int k = 0; k < 6; ++k) n[k] = parameters[k];
  n[ROUGH_PLASTIC_alpha] = larger(parameters[6], REAL(least_alpha));
  n[ROUGH_PLASTIC_eta] = parameters[7] / parameters[8];
  n[ROUGH_PLASTIC_nonlinear] = parameters[9];
  n[ROUGH_PLASTIC_trapped] = rough_trapped(variant, n[ROUGH_PLASTIC_alpha], n[ROUGH_PLASTIC_eta]);
  rough_transmittance_coefficients(variant, n[ROUGH_PLASTIC_alpha], n[ROUGH_PLASTIC_eta], n + ROUGH_PLASTIC_t0);
}
inline Refusal rough_plastic_refusal(const double* parameters) {
  if (parameters[7] > parameters[8]) return {};
  return {"int_ior", "is not above ext_ior:", parameters[7], "need the denser material inside"};
}
inline const char* rough_plastic_obstacle(const double* parameters, int slot) {
  if (slot < 6) return unless_zero(parameters[slot]);
  if (parameters[6] < least_alpha) return "alpha below 0.0001 is rendered as 0.0001";
  return coating_obstacle(parameters[7], parameters[8]);
}
#endif

#endif
