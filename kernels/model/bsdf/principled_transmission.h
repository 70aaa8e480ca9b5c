/* Mitsuba 3's "principled" with specular transmission: a boundary that light passes, under the lobes of principled.h.
 *
 *   wi above, reflection   D G / (4 wi.z) F + clearcoat + (1 - metallic) (1 - spec_trans) base + (1 - metallic) sheen
 *   wi below, reflection   b F_d D G / (4 |wi.z|),  b = (1 - metallic) spec_trans
 *   transmission           b sqrt(base_color) times that of rough_dielectric.h
 *
 * f |cos wo| [1/sr], for radiance: transmission holds 1 / eta^2. F: principled_reflectance, F_d: of the dielectric
 * alone. wi, wo: unit, leave the surface, in its frame, whose x axis follows the first texture coordinate. eta:
 * index inside over outside. From above, samples are of facets, clearcoat and base as in principled.h, and of the
 * facets' the share b (1 - F_d) is transmitted; from below, 1 - F_d.
 * Tests: tests/model/bsdfs_test.cpp, principled_test.cpp */
#ifndef ITN_PRINCIPLED_TRANSMISSION_H
#define ITN_PRINCIPLED_TRANSMISSION_H
#include "model/bsdf/rough_dielectric.h"
#include "model/principled_lobes.h"

#define PRINCIPLED_TRANSMISSION_NUMBERS(NUMBER)                                                  \
  PRINCIPLED_COMMON_NUMBERS(NUMBER, PRINCIPLED_TRANSMISSION)                                     \
  NUMBER(PRINCIPLED_TRANSMISSION, metallic, 1, ROLE_DENSITY, COORDINATE_ITSELF)                  \
  NUMBER(PRINCIPLED_TRANSMISSION, spec_trans, 1, ROLE_DENSITY, COORDINATE_ITSELF)                \
  NUMBER(PRINCIPLED_TRANSMISSION, clearcoat, 1, ROLE_DENSITY, COORDINATE_ITSELF)                 \
  NUMBER(PRINCIPLED_TRANSMISSION, clearcoat_gloss, 1, ROLE_DENSITY, COORDINATE_ITSELF)           \
  NUMBER(PRINCIPLED_TRANSMISSION, eta, 1, ROLE_INDEX, COORDINATE_LOG)                            \
  NUMBER(PRINCIPLED_TRANSMISSION, main_specular_sampling_rate, 1, ROLE_FIXED, COORDINATE_ITSELF) \
  NUMBER(PRINCIPLED_TRANSMISSION, clearcoat_sampling_rate, 1, ROLE_FIXED, COORDINATE_ITSELF)     \
  NUMBER(PRINCIPLED_TRANSMISSION, diffuse_reflectance_sampling_rate, 1, ROLE_FIXED, COORDINATE_ITSELF)
#define PRINCIPLED_TRANSMISSION_PARAMETERS(PARAMETER)          \
  PRINCIPLED_COMMON_PARAMETERS(PARAMETER)                      \
  PARAMETER(metallic, WEIGHT, 0, "")                           \
  PARAMETER(spec_trans, WEIGHT, 0, "")                         \
  PARAMETER(clearcoat, WEIGHT, 0, "")                          \
  PARAMETER(clearcoat_gloss, WEIGHT, 0, "")                    \
  PARAMETER(eta, INDEX_OR_SPECULAR, 1.5, "")                   \
  PARAMETER(main_specular_sampling_rate, SAMPLING_RATE, 1, "") \
  PARAMETER(clearcoat_sampling_rate, SAMPLING_RATE, 1, "")     \
  PARAMETER(diffuse_reflectance_sampling_rate, SAMPLING_RATE, 1, "")
#define PRINCIPLED_TRANSMISSION_TRAITS (BSDF_TRANSMITS | BSDF_ANISOTROPIC | BSDF_BROAD)
#define PRINCIPLED_TRANSMISSION_RANDOM 3
enum { PRINCIPLED_TRANSMISSION_NUMBERS(DECLARE_SLOT) PRINCIPLED_TRANSMISSION_SLOTS };

/* b */
MODEL principled_transmission_share(const REAL* n) {
  return (NUMBER(1) - n[PRINCIPLED_TRANSMISSION_metallic]) * n[PRINCIPLED_TRANSMISSION_spec_trans];
}

/* Probabilities of the clearcoat and of the base; the facets have the rest. */
MODEL_VOID principled_transmission_choice(const REAL* n, REAL3 wi, REAL* clearcoat, REAL* base) {
  REAL of_clearcoat =
      NUMBER(0.25) * n[PRINCIPLED_TRANSMISSION_clearcoat] * n[PRINCIPLED_TRANSMISSION_clearcoat_sampling_rate];
  REAL of_base = (NUMBER(1) - n[PRINCIPLED_TRANSMISSION_metallic]) *
                 (NUMBER(1) - n[PRINCIPLED_TRANSMISSION_spec_trans]) *
                 n[PRINCIPLED_TRANSMISSION_diffuse_reflectance_sampling_rate];
  REAL all = n[PRINCIPLED_TRANSMISSION_main_specular_sampling_rate] + of_clearcoat + of_base;
  *clearcoat = SELECT(wi.z > NUMBER(0), of_clearcoat / MAX(all, NUMBER(1e-20)), NUMBER(0));
  *base = SELECT(wi.z > NUMBER(0), of_base / MAX(all, NUMBER(1e-20)), NUMBER(0));
}

/* The share of a facet's samples that are mirrored. f: F_d */
MODEL principled_transmission_mirrored(const REAL* n, REAL3 wi, REAL f) {
  return SELECT(wi.z > NUMBER(0), NUMBER(1) - principled_transmission_share(n) * (NUMBER(1) - f), f);
}

MODEL principled_transmission_seen(const REAL* n, REAL3 wi, REAL3 h, REAL* shadowing, REAL3 wo) {
  REAL alpha_u, alpha_v;
  principled_alphas(n[LOBES_roughness], n[LOBES_anisotropic], &alpha_u, &alpha_v);
  *shadowing = anisotropic_shadowing(MICROFACET_GGX, wo, alpha_u, alpha_v);
  return anisotropic_normals(MICROFACET_GGX, h, alpha_u, alpha_v) *
         anisotropic_shadowing(MICROFACET_GGX, wi, alpha_u, alpha_v) / MAX(ABS(wi.z), NUMBER(1e-9));
}

/* |dh/dwo| |wi.h| of transmission at h, 0 where it is impossible. */
MODEL principled_transmission_jacobian(REAL eta, REAL3 wi, REAL3 wo, REAL3 h) {
  REAL ci = dot3(wi, h), co = dot3(wo, h), d = ci + eta * co;
  return SELECT((ci * wi.z > NUMBER(0)) & (co * wo.z > NUMBER(0)), eta * eta * ABS(ci * co) / MAX(d * d, NUMBER(1e-20)),
                NUMBER(0));
}

MODEL_VOID principled_transmission_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL eta = far_over_near(n[PRINCIPLED_TRANSMISSION_eta], wi.z), shadowing;
  REAL3 h = rough_dielectric_facet(eta, wi, wo);
  REAL facets = principled_transmission_seen(n, wi, h, &shadowing, wo) * shadowing;
  REAL cosine = MIN(ABS(dot3(wi, h)), NUMBER(1)), fresnel = fresnel_dielectric(cosine, eta);
  REAL share = principled_transmission_share(n), metallic = n[PRINCIPLED_TRANSMISSION_metallic];
  MASK above = wi.z > NUMBER(0), reflected = wi.z * wo.z > NUMBER(0);
  REAL passed = share * facets * (NUMBER(1) - fresnel) * principled_transmission_jacobian(eta, wi, wo, h) / (eta * eta);
  REAL weight = schlick_interface(cosine, eta), luminance = principled_luminance(n + LOBES_base_color);
  REAL clearcoat = n[PRINCIPLED_TRANSMISSION_clearcoat] *
                   clearcoat_value(n[PRINCIPLED_TRANSMISSION_clearcoat_gloss], eta, wi, wo, h, cosine);
  REAL base = principled_base(n, wi, wo, cosine) * (NUMBER(1) - n[PRINCIPLED_TRANSMISSION_spec_trans]);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) {
    REAL mirrored = NUMBER(0.25) * facets * principled_reflectance(n, c, metallic, eta, fresnel, weight, luminance);
    REAL matt = (NUMBER(1) - metallic) * principled_matt(n, c, base, luminance, cosine, wo);
    REAL through = passed * SQRT(MAX(n[LOBES_base_color + c], NUMBER(1e-30)));
    f[c] =
        SELECT(reflected, SELECT(above, mirrored + clearcoat + matt, NUMBER(0.25) * facets * share * fresnel), through);
  }
}

MODEL principled_transmission_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  REAL eta = far_over_near(n[PRINCIPLED_TRANSMISSION_eta], wi.z), shadowing, clearcoat, base;
  REAL3 h = rough_dielectric_facet(eta, wi, wo);
  REAL facets = principled_transmission_seen(n, wi, h, &shadowing, wo);
  REAL cosine = MIN(ABS(dot3(wi, h)), NUMBER(1));
  principled_transmission_choice(n, wi, &clearcoat, &base);
  REAL mirrored = principled_transmission_mirrored(n, wi, fresnel_dielectric(cosine, eta));
  REAL of_facets = (NUMBER(1) - clearcoat - base) * facets;
  REAL reflected = NUMBER(0.25) * of_facets * mirrored +
                   clearcoat * clearcoat_density(n[PRINCIPLED_TRANSMISSION_clearcoat_gloss], h, cosine) +
                   base * diffuse_pdf(wo);
  REAL passed = of_facets * (NUMBER(1) - mirrored) * principled_transmission_jacobian(eta, wi, wo, h);
  return SELECT(wi.z * wo.z > NUMBER(0), reflected, passed);
}

MODEL_VOID principled_transmission_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight,
                                        REAL* pdf, REAL* inverse_eta) {
  REAL alpha_u, alpha_v, clearcoat, base, f, ct;
  REAL eta = far_over_near(n[PRINCIPLED_TRANSMISSION_eta], wi.z),
       side = SELECT(wi.z > NUMBER(0), NUMBER(1), NUMBER(-1));
  REAL3 up = make3(wi.x, wi.y, MAX(ABS(wi.z), NUMBER(1e-9)));
  principled_alphas(n[LOBES_roughness], n[LOBES_anisotropic], &alpha_u, &alpha_v);
  principled_transmission_choice(n, wi, &clearcoat, &base);
  MASK from_base = u[0] < base, from_clearcoat = u[0] < base + clearcoat;
  REAL3 matt = diffuse_sample(u[1], u[2]);
  REAL3 coat =
      mirrored_at(up, clearcoat_sample(clearcoat_alpha(n[PRINCIPLED_TRANSMISSION_clearcoat_gloss]), u[1], u[2]));

  REAL3 m = anisotropic_visible_sample(MICROFACET_GGX, up, alpha_u, alpha_v, u[1], u[2]);
  REAL ci = dot3(up, m), of_facets = MAX(NUMBER(1) - base - clearcoat, NUMBER(1e-9));
  fresnel_dielectric_refract(MIN(ABS(ci), NUMBER(1)), eta, &f, &ct);
  MASK mirror = u[0] - base - clearcoat < of_facets * principled_transmission_mirrored(n, wi, f);
  REAL along_wi = SELECT(mirror, NUMBER(1), NUMBER(1) / eta);
  REAL3 facet = sub3(scale3(m, SELECT(mirror, NUMBER(2) * ci, ci * along_wi - ct)), scale3(up, along_wi));
  MASK lost = (ci < NUMBER(0)) | (SELECT(mirror, facet.z, -facet.z) < NUMBER(0));

  *wo = make3(SELECT(from_base, matt.x, SELECT(from_clearcoat, coat.x, facet.x)),
              SELECT(from_base, matt.y, SELECT(from_clearcoat, coat.y, facet.y)),
              side * SELECT(from_base, matt.z, SELECT(from_clearcoat, coat.z, facet.z)));
  /* of the base and the clearcoat, which wi from above alone has, `mirror` is true */
  MASK wrong = (from_clearcoat & !from_base & (coat.z < NUMBER(0))) | ((!from_clearcoat) & lost);
  *pdf = SELECT(wrong, NUMBER(0), principled_transmission_density(variant, n, wi, *wo));
  *inverse_eta = SELECT(mirror, NUMBER(1), NUMBER(1) / eta);
  REAL value[CHANNELS], radiance = SELECT(mirror, NUMBER(1), eta * eta);
  principled_transmission_value(variant, n, wi, *wo, value);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] = SELECT(*pdf > NUMBER(0), value[c] * radiance / MAX(*pdf, NUMBER(1e-20)), NUMBER(0));
}

MODEL3 principled_transmission_outcome(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL reflected) { return wo; }
MODEL principled_transmission_decision(int variant, const REAL* n, REAL3 wi, REAL3 outcome, REAL reflected) {
  return principled_transmission_density(variant, n, wi, outcome);
}
/* As of a rough dielectric: transmission jumps to 0 where the facet is upright. */
MODEL principled_transmission_edge(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  return rough_dielectric_ggx_edge(far_over_near(n[PRINCIPLED_TRANSMISSION_eta], wi.z), wi, wo);
}
BSDF_DRAWS_ALL(principled_transmission)

#ifndef __OPENCL_VERSION__
MODEL_VOID principled_transmission_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int k = 0; k < PRINCIPLED_TRANSMISSION_SLOTS; ++k) n[k] = parameters[k];
}
inline Refusal principled_transmission_refusal(const double* parameters) {
  const double* rates = parameters + PRINCIPLED_TRANSMISSION_main_specular_sampling_rate;
  return no_sampling_refusal("main_specular_sampling_rate", rates[0] + rates[1] + rates[2]);
}
inline const char* principled_transmission_obstacle(const double* parameters, int slot) {
  if (slot < LOBES_COMMON_SLOTS) return principled_common_obstacle(parameters, slot);
  if (slot == PRINCIPLED_TRANSMISSION_spec_trans) return unless_zero(parameters[slot]);
  return slot == PRINCIPLED_TRANSMISSION_eta ? principled_index_obstacle(parameters[slot]) : differentiable;
}
#endif

#endif
