/* Rough interface between two dielectrics with a roughness of its own along each axis of the surface: the formulas of
 * rough_dielectric.h with D and G1 of microfacet_anisotropic.h. alpha_u > 0 along x of the frame, which follows the first
 * texture coordinate, alpha_v > 0 along y. Agrees with Mitsuba 3's "roughdielectric" (visible normals).
 *   Walter, Marschner, Li, Torrance 2007, "Microfacet models for refraction through rough surfaces"
 * Tests: tests/model/bsdfs_test.cpp */
#ifndef ITN_ROUGH_DIELECTRIC_ANISOTROPIC_H
#define ITN_ROUGH_DIELECTRIC_ANISOTROPIC_H
#include "model/bsdf/rough_dielectric.h"
#include "model/microfacet_anisotropic.h"

/* eta: inside over outside; the variants are the distributions */
#define ROUGH_DIELECTRIC_ANISOTROPIC_NUMBERS(NUMBER)                                        \
  NUMBER(ROUGH_DIELECTRIC_ANISOTROPIC, alpha_u, 1, ROLE_DENSITY, COORDINATE_LOG)            \
  NUMBER(ROUGH_DIELECTRIC_ANISOTROPIC, alpha_v, 1, ROLE_DENSITY, COORDINATE_LOG)            \
  NUMBER(ROUGH_DIELECTRIC_ANISOTROPIC, eta, 1, ROLE_INDEX, COORDINATE_LOG)                  \
  NUMBER(ROUGH_DIELECTRIC_ANISOTROPIC, specular_reflectance, 3, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(ROUGH_DIELECTRIC_ANISOTROPIC, specular_transmittance, 3, ROLE_FIXED, COORDINATE_LOG)
#define ROUGH_DIELECTRIC_ANISOTROPIC_PARAMETERS(PARAMETER) \
  PARAMETER(alpha_u, ROUGHNESS_TEXTURE, 0.1, "")           \
  PARAMETER(alpha_v, ROUGHNESS_TEXTURE, 0.1, "")           \
  PARAMETER(int_ior, INDEX, 1.5046, "")                    \
  PARAMETER(ext_ior, INDEX, 1.000277, "")                  \
  PARAMETER(specular_reflectance, TINT, 1, "")             \
  PARAMETER(specular_transmittance, TINT, 1, "")
#define ROUGH_DIELECTRIC_ANISOTROPIC_TRAITS (BSDF_TRANSMITS | BSDF_BASELINE | BSDF_ANISOTROPIC)
#define ROUGH_DIELECTRIC_ANISOTROPIC_RANDOM 3
enum { ROUGH_DIELECTRIC_ANISOTROPIC_NUMBERS(DECLARE_SLOT) ROUGH_DIELECTRIC_ANISOTROPIC_SLOTS };

MODEL rough_dielectric_anisotropic_eta(const REAL* n, REAL3 wi) {
  return far_over_near(n[ROUGH_DIELECTRIC_ANISOTROPIC_eta], wi.z);
}

/* G1 */
MODEL rough_dielectric_anisotropic_shadowing(int variant, const REAL* n, REAL3 v) {
  return anisotropic_shadowing(variant, v, n[ROUGH_DIELECTRIC_ANISOTROPIC_alpha_u],
                               n[ROUGH_DIELECTRIC_ANISOTROPIC_alpha_v]);
}

/* D(h) G1(wi) */
MODEL rough_dielectric_anisotropic_seen(int variant, const REAL* n, REAL3 wi, REAL3 h) {
  return anisotropic_normals(variant, h, n[ROUGH_DIELECTRIC_ANISOTROPIC_alpha_u],
                             n[ROUGH_DIELECTRIC_ANISOTROPIC_alpha_v]) *
         rough_dielectric_anisotropic_shadowing(variant, n, wi);
}

MODEL rough_dielectric_anisotropic_tint(const REAL* n, int c, MASK reflected) {
  return SELECT(reflected, n[ROUGH_DIELECTRIC_ANISOTROPIC_specular_reflectance + c],
                n[ROUGH_DIELECTRIC_ANISOTROPIC_specular_transmittance + c]);
}

MODEL rough_dielectric_anisotropic_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  REAL eta = rough_dielectric_anisotropic_eta(n, wi);
  REAL3 h = rough_dielectric_facet(eta, wi, wo);
  return rough_dielectric_lobe(eta, wi, wo, h, rough_dielectric_anisotropic_seen(variant, n, wi, h));
}

MODEL_VOID rough_dielectric_anisotropic_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL eta = rough_dielectric_anisotropic_eta(n, wi);
  MASK reflected = wi.z * wo.z > NUMBER(0);
  REAL value = rough_dielectric_anisotropic_density(variant, n, wi, wo) *
               rough_dielectric_anisotropic_shadowing(variant, n, wo) *
               SELECT(reflected, NUMBER(1), NUMBER(1) / (eta * eta));
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) f[c] = value * rough_dielectric_anisotropic_tint(n, c, reflected);
}

MODEL_VOID rough_dielectric_anisotropic_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo,
                                             REAL* weight, REAL* pdf, REAL* inverse_eta) {
  REAL eta = rough_dielectric_anisotropic_eta(n, wi);
  REAL side = SELECT(wi.z < NUMBER(0), NUMBER(-1), NUMBER(1));
  REAL3 up = make3(wi.x, wi.y, side * wi.z), out;
  REAL3 m = anisotropic_visible_sample(variant, up, n[ROUGH_DIELECTRIC_ANISOTROPIC_alpha_u],
                                       n[ROUGH_DIELECTRIC_ANISOTROPIC_alpha_v], u[1], u[2]);
  REAL jacobian;
  MASK reflected = up.z > NUMBER(0), possible = up.z > NUMBER(0);
  rough_dielectric_scatter(eta, up, m, u[0], &out, inverse_eta, &jacobian, &reflected, &possible);
  REAL value = SELECT(possible, rough_dielectric_anisotropic_shadowing(variant, n, out), NUMBER(0));
  *pdf = SELECT(possible, rough_dielectric_anisotropic_seen(variant, n, up, m) * jacobian / up.z, NUMBER(0));
  *wo = make3(out.x, out.y, side * out.z);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) weight[c] = value * rough_dielectric_anisotropic_tint(n, c, reflected);
}

MODEL3 rough_dielectric_anisotropic_outcome(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL reflected) {
  return rough_dielectric_normal(rough_dielectric_anisotropic_eta(n, wi), wi, wo, reflected);
}

MODEL rough_dielectric_anisotropic_decision(int variant, const REAL* n, REAL3 wi, REAL3 outcome, REAL reflected) {
  REAL f = fresnel_dielectric(MIN(ABS(dot3(wi, outcome)), NUMBER(1)), rough_dielectric_anisotropic_eta(n, wi));
  return anisotropic_visible_density(variant, wi, outcome, n[ROUGH_DIELECTRIC_ANISOTROPIC_alpha_u],
                                     n[ROUGH_DIELECTRIC_ANISOTROPIC_alpha_v]) *
         SELECT(reflected > NUMBER(0.5), f, NUMBER(1) - f);
}

MODEL rough_dielectric_anisotropic_edge(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  if (variant != MICROFACET_GGX) return NUMBER(0);
  return rough_dielectric_ggx_edge(rough_dielectric_anisotropic_eta(n, wi), wi, wo);
}

BSDF_DRAWS_ALL(rough_dielectric_anisotropic)

#ifndef __OPENCL_VERSION__
MODEL_VOID rough_dielectric_anisotropic_numbers(int variant, const REAL* parameters, REAL* n) {
  n[ROUGH_DIELECTRIC_ANISOTROPIC_alpha_u] = larger(parameters[0], REAL(least_alpha));
  rough_dielectric_numbers(variant, parameters + 1, n + ROUGH_DIELECTRIC_ANISOTROPIC_alpha_v);
}
inline Refusal rough_dielectric_anisotropic_refusal(const double* parameters) {
  return rough_dielectric_refusal(parameters + 1);
}
inline const char* rough_dielectric_anisotropic_obstacle(const double* parameters, int slot) {
  const double with_u[3] = {parameters[0], parameters[2], parameters[3]};
  return slot == 0 ? rough_dielectric_obstacle(with_u, 0) : rough_dielectric_obstacle(parameters + 1, slot - 1);
}
#endif

#endif
