/* Ashikhmin and Shirley's anisotropic Phong gloss over a diffuse base that dims where the gloss reflects.
 *
 *   gloss  sqrt((e_u + 1) (e_v + 1)) / (8 pi) h.z^e / (wi.h max(wi.z, wo.z)) F(wi.h)
 *          e = (e_u h.x^2 + e_v h.y^2) / (1 - h.z^2),  F(c) = R_s + (1 - R_s) (1 - c)^5
 *   base   28 / (23 pi) R_d (1 - R_s) (1 - (1 - wi.z / 2)^5) (1 - (1 - wo.z / 2)^5)
 *
 * f = gloss + base [1/sr]; 0 unless both directions are above the surface. R_s, R_d: specular_reflectance (at normal
 * incidence) and diffuse_reflectance; e_u, e_v >= 0: exponents along the axes of the frame, whose x axis follows the
 * first texture coordinate. h ~ wi + wo; wi, wo: unit, leave the surface, in its frame. A sample of the gloss has a
 * normal of density sqrt((e_u + 1) (e_v + 1)) / (2 pi) h.z^e.
 *   Ashikhmin, Shirley 2000, "An anisotropic Phong BRDF model", doi:10.1080/10867651.2000.10487522
 * Tests: tests/model/bsdfs_test.cpp, own_surfaces_test.cpp */
#ifndef ITN_ASHIKHMIN_SHIRLEY_H
#define ITN_ASHIKHMIN_SHIRLEY_H
#include "model/bsdf/reflection.h"
#include "model/coating.h"
#include "model/microfacet_reflection.h"
#include "model/obstacle.h"

#define ASHIKHMIN_SHIRLEY_NUMBERS(NUMBER)                                         \
  NUMBER(ASHIKHMIN_SHIRLEY, diffuse_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG)  \
  NUMBER(ASHIKHMIN_SHIRLEY, specular_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(ASHIKHMIN_SHIRLEY, nu, 1, ROLE_DENSITY, COORDINATE_LOG)                  \
  NUMBER(ASHIKHMIN_SHIRLEY, nv, 1, ROLE_DENSITY, COORDINATE_LOG)
#define ASHIKHMIN_SHIRLEY_PARAMETERS(PARAMETER)         \
  PARAMETER(diffuse_reflectance, REFLECTANCE, 0.5, "")  \
  PARAMETER(specular_reflectance, REFLECTANCE, 0.2, "") \
  PARAMETER(nu, EXPONENT, 100, "")                      \
  PARAMETER(nv, EXPONENT, 100, "")
#define ASHIKHMIN_SHIRLEY_TRAITS BSDF_ANISOTROPIC
#define ASHIKHMIN_SHIRLEY_RANDOM 3
enum { ASHIKHMIN_SHIRLEY_NUMBERS(DECLARE_SLOT) ASHIKHMIN_SHIRLEY_SLOTS };

/* Probability that a sample is of the gloss. */
MODEL ashikhmin_shirley_choice(const REAL* n) {
  return coating_choice(n + ASHIKHMIN_SHIRLEY_specular_reflectance, n + ASHIKHMIN_SHIRLEY_diffuse_reflectance,
                        NUMBER(0.5));
}

/* Density of h. log h.z from 1 - h.z^2, by its series where h.z is so near 1 that its digits would be lost. */
MODEL ashikhmin_shirley_normals(const REAL* n, REAL3 h) {
  REAL eu = n[ASHIKHMIN_SHIRLEY_nu], ev = n[ASHIKHMIN_SHIRLEY_nv];
  REAL x2 = h.x * h.x, y2 = h.y * h.y, r2 = x2 + y2;
  REAL series = -r2 * (NUMBER(1) + r2 * (NUMBER(0.5) + r2 * (NUMBER(1.0 / 3) + r2 * NUMBER(0.25))));
  REAL log_z = NUMBER(0.5) * SELECT(r2 < NUMBER(0.02), series, LOG(MAX(h.z * h.z, NUMBER(1e-20))));
  REAL exponent = (eu * x2 + ev * y2) / MAX(r2, NUMBER(1e-20));
  return SQRT((eu + NUMBER(1)) * (ev + NUMBER(1))) * NUMBER(0.5 / PI_) * EXP(exponent * log_z);
}

MODEL fifth(REAL x) { return x * x * x * x * x; }

MODEL_VOID ashikhmin_shirley_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL3 h = reflection_half(wi, wo);
  REAL cosine = MAX(reflection_cosine(wi, wo), NUMBER(1e-9)), weight = fifth(NUMBER(1) - cosine);
  REAL gloss = ashikhmin_shirley_normals(n, h) * wo.z / (NUMBER(4) * cosine * MAX(MAX(wi.z, wo.z), NUMBER(1e-9)));
  REAL base = NUMBER(28 / (23 * PI_)) * (NUMBER(1) - fifth(NUMBER(1) - NUMBER(0.5) * wi.z)) *
              (NUMBER(1) - fifth(NUMBER(1) - NUMBER(0.5) * wo.z)) * wo.z;
  MASK possible = (wi.z > NUMBER(0)) & (wo.z > NUMBER(0));
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) {
    REAL specular = n[ASHIKHMIN_SHIRLEY_specular_reflectance + c],
         diffuse = n[ASHIKHMIN_SHIRLEY_diffuse_reflectance + c];
    REAL value = gloss * (specular + (NUMBER(1) - specular) * weight) + base * diffuse * (NUMBER(1) - specular);
    f[c] = SELECT(possible, value, NUMBER(0));
  }
}

MODEL ashikhmin_shirley_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  REAL choice = ashikhmin_shirley_choice(n);
  REAL gloss = ashikhmin_shirley_normals(n, reflection_half(wi, wo)) /
               (NUMBER(4) * MAX(reflection_cosine(wi, wo), NUMBER(1e-9)));
  MASK possible = (wi.z > NUMBER(0)) & (wo.z > NUMBER(0));
  return SELECT(possible, choice * gloss + (NUMBER(1) - choice) * diffuse_pdf(wo), NUMBER(0));
}

/* Draws from the gloss if u0 is below its probability; the sample is lost if its mirror image is below the surface. */
MODEL_VOID ashikhmin_shirley_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight,
                                  REAL* pdf, REAL* inverse_eta) {
  MASK glossy = u[0] < ashikhmin_shirley_choice(n);
  REAL eu = n[ASHIKHMIN_SHIRLEY_nu] + NUMBER(1), ev = n[ASHIKHMIN_SHIRLEY_nv] + NUMBER(1), s, c;
  sin_cos_2pi(u[1], &s, &c);
  /* the azimuth's tangent is sqrt(eu / ev) times that of a uniform one */
  REAL x = SQRT(ev) * c, y = SQRT(eu) * s, length2 = x * x + y * y;
  REAL exponent = (eu * x * x + ev * y * y) / length2;
  REAL z = EXP(LOG(u[2]) / exponent), sine = SQRT(MAX(NUMBER(1) - z * z, NUMBER(0)) / length2);
  REAL3 m = make3(x * sine, y * sine, z);
  REAL3 mirrored = sub3(scale3(m, NUMBER(2) * dot3(wi, m)), wi), matt = diffuse_sample(u[1], u[2]);
  *wo =
      make3(SELECT(glossy, mirrored.x, matt.x), SELECT(glossy, mirrored.y, matt.y), SELECT(glossy, mirrored.z, matt.z));
  *pdf = ashikhmin_shirley_density(variant, n, wi, *wo);
  *inverse_eta = NUMBER(1);
  REAL f[CHANNELS];
  ashikhmin_shirley_value(variant, n, wi, *wo, f);
  UNROLL_FOR(int k = 0; k < CHANNELS; ++k)
    weight[k] = SELECT(*pdf > NUMBER(0), f[k] / MAX(*pdf, NUMBER(1e-20)), NUMBER(0));
}

BSDF_DECIDES_DIRECTION(ashikhmin_shirley)
BSDF_DRAWS_ALL(ashikhmin_shirley)

#ifndef __OPENCL_VERSION__
MODEL_VOID ashikhmin_shirley_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int k = 0; k < ASHIKHMIN_SHIRLEY_SLOTS; ++k) n[k] = parameters[k];
}
inline Refusal ashikhmin_shirley_refusal(const double*) { return {}; }
inline const char* ashikhmin_shirley_obstacle(const double* parameters, int slot) {
  return unless_zero(parameters[slot]);
}
#endif

#endif
