/* Mitsuba 3's "principledthin": a sheet that reflects and passes light, alike from both sides. With both directions
 * turned so that wi is above, and t = diff_trans / 2:
 *
 *   reflection     spec_trans F D G / (4 wi.z) + (1 - spec_trans) (1 - t) (base + sheen)
 *   transmission   spec_trans base_color (1 - F_d) D' G' / (4 wi.z) + (1 - spec_trans) t base_color / pi |cos wo|
 *
 * f |cos wo| [1/sr]; the lobes of principled_lobes.h. Facets mirror light, and what they pass is its mirror image
 * below, where they turn their other side to it; D' and G' have the roughness (0.65 eta - 0.35) roughness. F_d:
 * reflectance of the dielectric, F: it, tinted towards base_color by spec_tint. wi, wo: unit, leave the surface, in
 * its frame, whose x axis follows the first texture coordinate. eta: index of the sheet over that around it.
 * Tests: tests/model/bsdfs_test.cpp, principled_test.cpp */
#ifndef ITN_PRINCIPLED_THIN_H
#define ITN_PRINCIPLED_THIN_H
#include "model/bsdf/reflection.h"
#include "model/principled_lobes.h"

#define PRINCIPLED_THIN_NUMBERS(NUMBER)                                                           \
  PRINCIPLED_COMMON_NUMBERS(NUMBER, PRINCIPLED_THIN)                                              \
  NUMBER(PRINCIPLED_THIN, spec_trans, 1, ROLE_DENSITY, COORDINATE_ITSELF)                         \
  NUMBER(PRINCIPLED_THIN, diff_trans, 1, ROLE_DENSITY, COORDINATE_ITSELF)                         \
  NUMBER(PRINCIPLED_THIN, eta, 1, ROLE_INDEX, COORDINATE_LOG)                                     \
  NUMBER(PRINCIPLED_THIN, specular_reflectance_sampling_rate, 1, ROLE_FIXED, COORDINATE_ITSELF)   \
  NUMBER(PRINCIPLED_THIN, specular_transmittance_sampling_rate, 1, ROLE_FIXED, COORDINATE_ITSELF) \
  NUMBER(PRINCIPLED_THIN, diffuse_reflectance_sampling_rate, 1, ROLE_FIXED, COORDINATE_ITSELF)    \
  NUMBER(PRINCIPLED_THIN, diffuse_transmittance_sampling_rate, 1, ROLE_FIXED, COORDINATE_ITSELF)
#define PRINCIPLED_THIN_PARAMETERS(PARAMETER)                           \
  PRINCIPLED_COMMON_PARAMETERS(PARAMETER)                               \
  PARAMETER(spec_trans, WEIGHT, 0, "")                                  \
  PARAMETER(diff_trans, DOUBLE_WEIGHT, 0, "")                           \
  PARAMETER(eta, INDEX_TEXTURE, 1.5, "")                                \
  PARAMETER(specular_reflectance_sampling_rate, SAMPLING_RATE, 1, "")   \
  PARAMETER(specular_transmittance_sampling_rate, SAMPLING_RATE, 1, "") \
  PARAMETER(diffuse_reflectance_sampling_rate, SAMPLING_RATE, 1, "")    \
  PARAMETER(diffuse_transmittance_sampling_rate, SAMPLING_RATE, 1, "")
#define PRINCIPLED_THIN_TRAITS (BSDF_TRANSMITS | BSDF_ANISOTROPIC | BSDF_THIN | BSDF_BROAD)
#define PRINCIPLED_THIN_RANDOM 3
enum { PRINCIPLED_THIN_NUMBERS(DECLARE_SLOT) PRINCIPLED_THIN_SLOTS };

/* The share of (1 - spec_trans) that is passed. */
MODEL principled_thin_passed(const REAL* n) { return NUMBER(0.5) * n[PRINCIPLED_THIN_diff_trans]; }

/* Probabilities, in order: mirrored, passed by facets, diffuse reflection; diffuse transmission has the rest. */
MODEL_VOID principled_thin_choice(const REAL* n, REAL chance[]) {
  REAL facets = NUMBER(0.5) * n[PRINCIPLED_THIN_spec_trans], matt = NUMBER(1) - n[PRINCIPLED_THIN_spec_trans];
  REAL passed = principled_thin_passed(n);
  chance[0] = facets * n[PRINCIPLED_THIN_specular_reflectance_sampling_rate];
  chance[1] = facets * n[PRINCIPLED_THIN_specular_transmittance_sampling_rate];
  chance[2] = matt * (NUMBER(1) - passed) * n[PRINCIPLED_THIN_diffuse_reflectance_sampling_rate];
  REAL all = chance[0] + chance[1] + chance[2] + matt * passed * n[PRINCIPLED_THIN_diffuse_transmittance_sampling_rate];
  UNROLL_FOR(int k = 0; k < 3; ++k) chance[k] = chance[k] / MAX(all, NUMBER(1e-20));
}

MODEL_VOID principled_thin_alphas(const REAL* n, REAL scale, REAL* alpha_u, REAL* alpha_v) {
  principled_alphas(scale * n[LOBES_roughness], n[LOBES_anisotropic], alpha_u, alpha_v);
}

/* The scale of the roughness of facets that pass light */
MODEL principled_thin_scale(const REAL* n) { return NUMBER(0.65) * n[PRINCIPLED_THIN_eta] - NUMBER(0.35); }

/* The direction, turned with wi. */
MODEL3 principled_thin_turned(REAL3 wi, REAL3 w) { return scale3(w, SELECT(wi.z > NUMBER(0), NUMBER(1), NUMBER(-1))); }

/* A direction below as its mirror image above. */
MODEL3 principled_thin_above(REAL3 w) { return make3(w.x, w.y, ABS(w.z)); }

/* Do facets turn their other side to what they pass? wo below, above: its mirror image */
MODEL principled_thin_faces(REAL3 wi, REAL3 wo, REAL3 above) {
  return SELECT(dot3(wo, add3(wi, above)) < NUMBER(0), NUMBER(1), NUMBER(0));
}

MODEL_VOID principled_thin_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL3 arrival = principled_thin_turned(wi, wi), leaves = principled_thin_turned(wi, wo);
  REAL3 above = principled_thin_above(leaves);
  REAL cosine = reflection_cosine(arrival, above), eta = n[PRINCIPLED_THIN_eta];
  REAL fresnel = fresnel_dielectric(cosine, eta), specular = n[PRINCIPLED_THIN_spec_trans];
  REAL weight = schlick_interface(cosine, eta), luminance = principled_luminance(n + LOBES_base_color);
  REAL u, v, u_passed, v_passed;
  principled_thin_alphas(n, NUMBER(1), &u, &v);
  principled_thin_alphas(n, principled_thin_scale(n), &u_passed, &v_passed);
  REAL mirrored = specular * anisotropic_reflection_density(MICROFACET_GGX, u, v, arrival, above) *
                  anisotropic_shadowing(MICROFACET_GGX, above, u, v);
  REAL passed = specular * (NUMBER(1) - fresnel) * principled_thin_faces(arrival, leaves, above) *
                anisotropic_reflection_density(MICROFACET_GGX, u_passed, v_passed, arrival, above) *
                anisotropic_shadowing(MICROFACET_GGX, above, u_passed, v_passed);
  REAL matt = NUMBER(1) - specular, through = principled_thin_passed(n);
  REAL base = principled_base(n, arrival, above, cosine);
  MASK reflected = leaves.z > NUMBER(0);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) {
    REAL reflectance = principled_reflectance(n, c, NUMBER(0), eta, fresnel, weight, luminance);
    REAL back =
        mirrored * reflectance + matt * (NUMBER(1) - through) * principled_matt(n, c, base, luminance, cosine, above);
    REAL on = n[LOBES_base_color + c] * (passed + matt * through * diffuse_pdf(above));
    f[c] = SELECT(reflected, back, on);
  }
}

MODEL principled_thin_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  REAL3 arrival = principled_thin_turned(wi, wi), leaves = principled_thin_turned(wi, wo);
  REAL3 above = principled_thin_above(leaves);
  REAL chance[3], u, v, u_passed, v_passed;
  principled_thin_choice(n, chance);
  principled_thin_alphas(n, NUMBER(1), &u, &v);
  principled_thin_alphas(n, principled_thin_scale(n), &u_passed, &v_passed);
  REAL matt = diffuse_pdf(above);
  REAL back = chance[0] * anisotropic_reflection_density(MICROFACET_GGX, u, v, arrival, above) + chance[2] * matt;
  REAL on = chance[1] * principled_thin_faces(arrival, leaves, above) *
                anisotropic_reflection_density(MICROFACET_GGX, u_passed, v_passed, arrival, above) +
            (NUMBER(1) - chance[0] - chance[1] - chance[2]) * matt;
  return SELECT(leaves.z > NUMBER(0), back, on);
}

MODEL_VOID principled_thin_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                                REAL* inverse_eta) {
  REAL3 arrival = principled_thin_turned(wi, wi);
  REAL chance[3], alpha_u, alpha_v, cosine;
  principled_thin_choice(n, chance);
  REAL facets = chance[0] + chance[1];
  MASK mirrored = u[0] < chance[0], from_facets = u[0] < facets, reflected = u[0] < facets + chance[2];
  principled_thin_alphas(n, SELECT(mirrored, NUMBER(1), principled_thin_scale(n)), &alpha_u, &alpha_v);
  REAL3 facet = anisotropic_reflection_sample(MICROFACET_GGX, alpha_u, alpha_v, arrival, u[1], u[2], &cosine);
  REAL3 matt = diffuse_sample(u[1], u[2]);
  REAL3 above = make3(SELECT(from_facets, facet.x, matt.x), SELECT(from_facets, facet.y, matt.y),
                      SELECT(from_facets, facet.z, matt.z));
  REAL side = SELECT(from_facets, SELECT(mirrored, NUMBER(1), NUMBER(-1)), SELECT(reflected, NUMBER(1), NUMBER(-1)));
  *wo = principled_thin_turned(wi, make3(above.x, above.y, side * above.z));
  /* lost: below, or passed by facets that turn the same side to both directions */
  REAL faces = principled_thin_faces(arrival, make3(above.x, above.y, -above.z), above);
  REAL kept = SELECT(mirrored | !from_facets, NUMBER(1), faces);
  *pdf = SELECT((above.z > NUMBER(0)) & (kept > NUMBER(0.5)), principled_thin_density(variant, n, wi, *wo), NUMBER(0));
  *inverse_eta = NUMBER(1);
  REAL f[CHANNELS];
  principled_thin_value(variant, n, wi, *wo, f);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] = SELECT(*pdf > NUMBER(0), f[c] / MAX(*pdf, NUMBER(1e-20)), NUMBER(0));
}

BSDF_DECIDES_DIRECTION(principled_thin)
BSDF_DRAWS_ALL(principled_thin)

#ifndef __OPENCL_VERSION__
MODEL_VOID principled_thin_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int k = 0; k < PRINCIPLED_THIN_SLOTS; ++k) n[k] = parameters[k];
}
inline Refusal principled_thin_refusal(const double* parameters) {
  const double* rates = parameters + PRINCIPLED_THIN_specular_reflectance_sampling_rate;
  return no_sampling_refusal("specular_reflectance_sampling_rate", rates[0] + rates[1] + rates[2] + rates[3]);
}
inline const char* principled_thin_obstacle(const double* parameters, int slot) {
  if (slot < LOBES_COMMON_SLOTS) return principled_common_obstacle(parameters, slot);
  if (slot == PRINCIPLED_THIN_spec_trans || slot == PRINCIPLED_THIN_diff_trans) return unless_zero(parameters[slot]);
  return slot == PRINCIPLED_THIN_eta ? principled_index_obstacle(parameters[slot]) : differentiable;
}
#endif

#endif
