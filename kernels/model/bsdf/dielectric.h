/* Smooth interface between two dielectrics: mirror reflection and Snell refraction.
 *
 * wi, wo: unit, leave the surface, in its frame (z: normal); wi on either side. eta > 0: refractive index of the side
 * opposite to wi over that of wi's side. Agrees with Mitsuba 3's "dielectric" for radiance.
 * Tests: tests/model/dielectric_test.cpp */
#ifndef ITN_DIELECTRIC_H
#define ITN_DIELECTRIC_H
#include "model/bsdf/reflection.h"
#include "model/fresnel_dielectric.h"
#include "model/obstacle.h"

/* eta: inside over outside */
#define DIELECTRIC_NUMBERS(NUMBER)                                        \
  NUMBER(DIELECTRIC, eta, 1, ROLE_FIXED, COORDINATE_LOG)                  \
  NUMBER(DIELECTRIC, specular_reflectance, 3, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(DIELECTRIC, specular_transmittance, 3, ROLE_FIXED, COORDINATE_LOG)
#define DIELECTRIC_PARAMETERS(PARAMETER)       \
  PARAMETER(int_ior, INDEX, 1.5046, "")        \
  PARAMETER(ext_ior, INDEX, 1.000277, "")      \
  PARAMETER(specular_reflectance, TINT, 1, "") \
  PARAMETER(specular_transmittance, TINT, 1, "")
#define DIELECTRIC_TRAITS (BSDF_TRANSMITS | BSDF_SMOOTH)
#define DIELECTRIC_RANDOM 3
enum { DIELECTRIC_NUMBERS(DECLARE_SLOT) DIELECTRIC_SLOTS };

/* Reflection if u < F, else transmission. *weight: 1, over eta^2 for transmission (radiance changes between media). */
MODEL_VOID dielectric_sample(REAL eta, REAL3 wi, REAL u, REAL3* wo, REAL* weight, MASK* reflected) {
  REAL f, cos_t;
  fresnel_dielectric_refract(ABS(wi.z), eta, &f, &cos_t);
  MASK mirror = u < f;
  REAL scale = SELECT(mirror, NUMBER(1), NUMBER(1) / eta);
  *wo = make3(-wi.x * scale, -wi.y * scale, SELECT(mirror, wi.z, SELECT(wi.z < NUMBER(0), cos_t, -cos_t)));
  *weight = scale * scale;
  *reflected = mirror;
}

MODEL_VOID dielectric_chosen(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL reflected = fresnel_dielectric(ABS(wi.z), far_over_near(n[DIELECTRIC_eta], wi.z));
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    f[c] = SELECT(wi.z * wo.z > NUMBER(0), reflected * n[DIELECTRIC_specular_reflectance + c],
                  (NUMBER(1) - reflected) * n[DIELECTRIC_specular_transmittance + c]);
}

MODEL_VOID dielectric_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                           REAL* inverse_eta) {
  REAL eta = far_over_near(n[DIELECTRIC_eta], wi.z), squared;
  MASK reflected = wi.z > NUMBER(0);
  dielectric_sample(eta, wi, u[0], wo, &squared, &reflected);
  *pdf = NUMBER(0);
  *inverse_eta = SELECT(reflected, NUMBER(1), NUMBER(1) / eta);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] = SELECT(reflected, n[DIELECTRIC_specular_reflectance + c], n[DIELECTRIC_specular_transmittance + c]);
}

BSDF_CHOOSES_ALL(dielectric)
BSDF_DECIDES_DIRECTION(dielectric)

#ifndef __OPENCL_VERSION__
MODEL_VOID dielectric_numbers(int variant, const REAL* parameters, REAL* n) {
  n[DIELECTRIC_eta] = parameters[0] / parameters[1];
  for (int k = 0; k < 6; ++k) n[DIELECTRIC_specular_reflectance + k] = parameters[2 + k];
}
inline Refusal dielectric_refusal(const double*) { return {}; }
inline const char* dielectric_obstacle(const double*, int) {
  return "smooth interface: use roughdielectric with a small alpha";
}
#endif

#endif
