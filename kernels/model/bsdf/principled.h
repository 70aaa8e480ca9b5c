/* Mitsuba 3's "principled" without specular transmission: an opaque surface.
 *
 *   f |cos wo| = D G / (4 wi.z) F + clearcoat + (1 - metallic) (base + sheen)  [1/sr]
 *
 * with the lobes of principled_lobes.h; 0 unless both directions are above the surface. F: principled_reflectance,
 * G = G1(wi) G1(wo). wi, wo: unit, leave the surface, in its frame, whose x axis follows the first texture coordinate.
 * eta: index inside over outside. Samples are of the facets, the clearcoat and the base in the proportions
 * main_specular_sampling_rate : clearcoat / 4 clearcoat_sampling_rate : (1 - metallic)
 * diffuse_reflectance_sampling_rate. Lobes are added: with sheen or a clearcoat more light than arrives may come
 * back at grazing angles, as in Mitsuba.
 * Tests: tests/model/bsdfs_test.cpp, principled_test.cpp */
#ifndef ITN_PRINCIPLED_H
#define ITN_PRINCIPLED_H
#include "model/bsdf/reflection.h"
#include "model/obstacle.h"
#include "model/principled_lobes.h"

#define PRINCIPLED_NUMBERS(NUMBER)                                                  \
  PRINCIPLED_COMMON_NUMBERS(NUMBER, PRINCIPLED)                                     \
  NUMBER(PRINCIPLED, metallic, 1, ROLE_DENSITY, COORDINATE_ITSELF)                  \
  NUMBER(PRINCIPLED, clearcoat, 1, ROLE_DENSITY, COORDINATE_ITSELF)                 \
  NUMBER(PRINCIPLED, clearcoat_gloss, 1, ROLE_DENSITY, COORDINATE_ITSELF)           \
  NUMBER(PRINCIPLED, eta, 1, ROLE_INDEX, COORDINATE_LOG)                            \
  NUMBER(PRINCIPLED, main_specular_sampling_rate, 1, ROLE_FIXED, COORDINATE_ITSELF) \
  NUMBER(PRINCIPLED, clearcoat_sampling_rate, 1, ROLE_FIXED, COORDINATE_ITSELF)     \
  NUMBER(PRINCIPLED, diffuse_reflectance_sampling_rate, 1, ROLE_FIXED, COORDINATE_ITSELF)
#define PRINCIPLED_PARAMETERS(PARAMETER)                       \
  PRINCIPLED_COMMON_PARAMETERS(PARAMETER)                      \
  PARAMETER(metallic, WEIGHT, 0, "")                           \
  PARAMETER(clearcoat, WEIGHT, 0, "")                          \
  PARAMETER(clearcoat_gloss, WEIGHT, 0, "")                    \
  PARAMETER(eta, INDEX_OR_SPECULAR, 1.5, "")                   \
  PARAMETER(main_specular_sampling_rate, SAMPLING_RATE, 1, "") \
  PARAMETER(clearcoat_sampling_rate, SAMPLING_RATE, 1, "")     \
  PARAMETER(diffuse_reflectance_sampling_rate, SAMPLING_RATE, 1, "")
#define PRINCIPLED_TRAITS BSDF_ANISOTROPIC
#define PRINCIPLED_RANDOM 3
enum { PRINCIPLED_NUMBERS(DECLARE_SLOT) PRINCIPLED_SLOTS };

/* Probabilities of the clearcoat and of the base; the facets have the rest. */
MODEL_VOID principled_choice(const REAL* n, REAL* clearcoat, REAL* base) {
  REAL of_clearcoat = NUMBER(0.25) * n[PRINCIPLED_clearcoat] * n[PRINCIPLED_clearcoat_sampling_rate];
  REAL of_base = (NUMBER(1) - n[PRINCIPLED_metallic]) * n[PRINCIPLED_diffuse_reflectance_sampling_rate];
  REAL all = n[PRINCIPLED_main_specular_sampling_rate] + of_clearcoat + of_base;
  *clearcoat = of_clearcoat / MAX(all, NUMBER(1e-20));
  *base = of_base / MAX(all, NUMBER(1e-20));
}

MODEL_VOID principled_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL alpha_u, alpha_v;
  principled_alphas(n[LOBES_roughness], n[LOBES_anisotropic], &alpha_u, &alpha_v);
  REAL3 h = reflection_half(wi, wo);
  REAL cosine = reflection_cosine(wi, wo), eta = n[PRINCIPLED_eta];
  REAL facets = anisotropic_reflection_density(MICROFACET_GGX, alpha_u, alpha_v, wi, wo) *
                anisotropic_shadowing(MICROFACET_GGX, wo, alpha_u, alpha_v);
  REAL weight = schlick_interface(cosine, eta), fresnel = fresnel_dielectric(cosine, eta);
  MASK possible = (wi.z > NUMBER(0)) & (wo.z > NUMBER(0));
  REAL clearcoat = n[PRINCIPLED_clearcoat] * clearcoat_value(n[PRINCIPLED_clearcoat_gloss], eta, wi, wo, h, cosine);
  REAL base = principled_base(n, wi, wo, cosine), luminance = principled_luminance(n + LOBES_base_color);
  REAL dielectric = NUMBER(1) - n[PRINCIPLED_metallic];
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) {
    REAL mirrored = facets * principled_reflectance(n, c, n[PRINCIPLED_metallic], eta, fresnel, weight, luminance);
    f[c] = SELECT(possible, mirrored + clearcoat + dielectric * principled_matt(n, c, base, luminance, cosine, wo),
                  NUMBER(0));
  }
}

MODEL principled_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  REAL alpha_u, alpha_v, clearcoat, base;
  principled_alphas(n[LOBES_roughness], n[LOBES_anisotropic], &alpha_u, &alpha_v);
  principled_choice(n, &clearcoat, &base);
  REAL density =
      (NUMBER(1) - clearcoat - base) * anisotropic_reflection_density(MICROFACET_GGX, alpha_u, alpha_v, wi, wo) +
      clearcoat * clearcoat_density(n[PRINCIPLED_clearcoat_gloss], reflection_half(wi, wo), reflection_cosine(wi, wo)) +
      base * diffuse_pdf(wo);
  return SELECT((wi.z > NUMBER(0)) & (wo.z > NUMBER(0)), density, NUMBER(0));
}

MODEL_VOID principled_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                           REAL* inverse_eta) {
  REAL alpha_u, alpha_v, clearcoat, base, cosine;
  principled_alphas(n[LOBES_roughness], n[LOBES_anisotropic], &alpha_u, &alpha_v);
  principled_choice(n, &clearcoat, &base);
  MASK from_base = u[0] < base, from_clearcoat = u[0] < base + clearcoat;
  REAL3 matt = diffuse_sample(u[1], u[2]);
  REAL3 coat = mirrored_at(wi, clearcoat_sample(clearcoat_alpha(n[PRINCIPLED_clearcoat_gloss]), u[1], u[2]));
  REAL3 facet = anisotropic_reflection_sample(MICROFACET_GGX, alpha_u, alpha_v, wi, u[1], u[2], &cosine);
  *wo = make3(SELECT(from_base, matt.x, SELECT(from_clearcoat, coat.x, facet.x)),
              SELECT(from_base, matt.y, SELECT(from_clearcoat, coat.y, facet.y)),
              SELECT(from_base, matt.z, SELECT(from_clearcoat, coat.z, facet.z)));
  *pdf = principled_density(variant, n, wi, *wo);
  *inverse_eta = NUMBER(1);
  REAL f[CHANNELS];
  principled_value(variant, n, wi, *wo, f);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] = SELECT(*pdf > NUMBER(0), f[c] / MAX(*pdf, NUMBER(1e-20)), NUMBER(0));
}

BSDF_DECIDES_DIRECTION(principled)
BSDF_DRAWS_ALL(principled)

#ifndef __OPENCL_VERSION__
MODEL_VOID principled_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int k = 0; k < PRINCIPLED_SLOTS; ++k) n[k] = parameters[k];
}
inline Refusal principled_refusal(const double* parameters) {
  const double* rates = parameters + PRINCIPLED_main_specular_sampling_rate;
  return no_sampling_refusal("main_specular_sampling_rate", rates[0] + rates[1] + rates[2]);
}
inline const char* principled_obstacle(const double* parameters, int slot) {
  if (slot < LOBES_COMMON_SLOTS) return principled_common_obstacle(parameters, slot);
  return slot == PRINCIPLED_eta ? principled_index_obstacle(parameters[slot]) : differentiable;
}
#endif

#endif
