/* Mitsuba 3's "pplastic" without polarisation, as its rgb variants render it: a rough coating over a diffuse base,
 * simply added.
 *
 *   f |cos wo| = F(wi.h) D G / (4 wi.z) specular_reflectance + (1 - F(wi)) (1 - F(wo)) wo.z / pi diffuse_reflectance
 *
 * [1/sr]; 0 unless both directions are above the surface. h ~ wi + wo, G = G1(wi) G1(wo); wi, wo: unit, leave the
 * surface, in its frame. D, G1: microfacet.h; the variants are the distributions.
 *   Baek, Jeon, Tong, Kim 2018, "Simultaneous acquisition of polarimetric SVBRDF and normals"
 * Tests: tests/model/plastics_test.cpp, bsdfs_test.cpp */
#ifndef ITN_POLARIZED_PLASTIC_H
#define ITN_POLARIZED_PLASTIC_H
#include "model/bsdf/reflection.h"
#include "model/coating.h"
#include "model/fresnel_dielectric.h"
#include "model/microfacet_reflection.h"
#include "model/obstacle.h"

/* eta: inside over outside */
#define POLARIZED_PLASTIC_NUMBERS(NUMBER)                                         \
  NUMBER(POLARIZED_PLASTIC, diffuse_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG)  \
  NUMBER(POLARIZED_PLASTIC, specular_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(POLARIZED_PLASTIC, alpha, 1, ROLE_DENSITY, COORDINATE_LOG)               \
  NUMBER(POLARIZED_PLASTIC, eta, 1, ROLE_INDEX, COORDINATE_LOG)
#define POLARIZED_PLASTIC_PARAMETERS(PARAMETER)        \
  PARAMETER(diffuse_reflectance, REFLECTANCE, 0.5, "") \
  PARAMETER(specular_reflectance, REFLECTANCE, 1, "")  \
  PARAMETER(alpha, ROUGHNESS, 0.1, "")                 \
  PARAMETER(int_ior, INDEX, 1.49, "")                  \
  PARAMETER(ext_ior, INDEX, 1.000277, "")
#define POLARIZED_PLASTIC_TRAITS 0
#define POLARIZED_PLASTIC_RANDOM 3
enum { POLARIZED_PLASTIC_NUMBERS(DECLARE_SLOT) POLARIZED_PLASTIC_SLOTS };

MODEL polarized_plastic_passes(const REAL* n, REAL3 w) {
  return NUMBER(1) - fresnel_dielectric(MIN(MAX(w.z, NUMBER(0)), NUMBER(1)), n[POLARIZED_PLASTIC_eta]);
}

/* Probability that a sample is of the coating, by the two reflectances alone. */
MODEL polarized_plastic_choice(const REAL* n) {
  return coating_choice(n + POLARIZED_PLASTIC_specular_reflectance, n + POLARIZED_PLASTIC_diffuse_reflectance,
                        NUMBER(0.5));
}

MODEL_VOID polarized_plastic_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL alpha = n[POLARIZED_PLASTIC_alpha];
  REAL coating = reflection_density(variant, alpha, wi, wo) * microfacet_shadowing(variant, wo, alpha) *
                 fresnel_dielectric(reflection_cosine(wi, wo), n[POLARIZED_PLASTIC_eta]);
  REAL passed = SELECT(wi.z > NUMBER(0), polarized_plastic_passes(n, wi) * polarized_plastic_passes(n, wo), NUMBER(0));
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    f[c] = coating * n[POLARIZED_PLASTIC_specular_reflectance + c] +
           diffuse_eval(n[POLARIZED_PLASTIC_diffuse_reflectance + c], wo) * passed;
}

MODEL polarized_plastic_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  REAL choice = polarized_plastic_choice(n);
  REAL density =
      choice * reflection_density(variant, n[POLARIZED_PLASTIC_alpha], wi, wo) + (NUMBER(1) - choice) * diffuse_pdf(wo);
  return SELECT(wi.z > NUMBER(0), density, NUMBER(0));
}

/* Draws from the coating if u0 is below its probability; the sample is lost if its mirror image is below the
 * surface. */
MODEL_VOID polarized_plastic_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight,
                                  REAL* pdf, REAL* inverse_eta) {
  MASK from_coating = u[0] < polarized_plastic_choice(n);
  REAL cosine;
  REAL3 mirrored = reflection_sample(variant, n[POLARIZED_PLASTIC_alpha], wi, u[1], u[2], &cosine);
  REAL3 from_base = diffuse_sample(u[1], u[2]);
  *wo = make3(SELECT(from_coating, mirrored.x, from_base.x), SELECT(from_coating, mirrored.y, from_base.y),
              SELECT(from_coating, mirrored.z, from_base.z));
  *pdf = SELECT(wo->z > NUMBER(0), polarized_plastic_density(variant, n, wi, *wo), NUMBER(0));
  *inverse_eta = NUMBER(1);
  REAL f[CHANNELS];
  polarized_plastic_value(variant, n, wi, *wo, f);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] = SELECT(*pdf > NUMBER(0), f[c] / MAX(*pdf, NUMBER(1e-20)), NUMBER(0));
}

BSDF_DECIDES_DIRECTION(polarized_plastic)
BSDF_DRAWS_ALL(polarized_plastic)

#ifndef __OPENCL_VERSION__
MODEL_VOID polarized_plastic_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int k = 0; k < 6; ++k) n[k] = parameters[k];
  n[POLARIZED_PLASTIC_alpha] = larger(parameters[6], REAL(least_alpha));
  n[POLARIZED_PLASTIC_eta] = parameters[7] / parameters[8];
}
inline Refusal polarized_plastic_refusal(const double* parameters) {
  return equal_indices_refusal(parameters[7], parameters[8]);
}
inline const char* polarized_plastic_obstacle(const double* parameters, int slot) {
  if (slot < 6) return unless_zero(parameters[slot]);
  if (parameters[6] < least_alpha) return "alpha below 0.0001 is rendered as 0.0001";
  return coating_obstacle(parameters[7], parameters[8]);
}
#endif

#endif
