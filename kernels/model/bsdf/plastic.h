/* Smooth plastic: a diffuse base under a smooth dielectric coating, which reflects as a mirror.
 *
 *   mirror  F(wi) specular_reflectance
 *   base    coating.h with T = 1 - F and R the diffuse reflectance of the smooth interface
 *
 * wi, wo: unit, leave the surface, in its frame. Agrees with Mitsuba 3's "plastic".
 * Tests: tests/model/plastics_test.cpp, bsdfs_test.cpp */
#ifndef ITN_PLASTIC_H
#define ITN_PLASTIC_H
#include "model/bsdf/reflection.h"
#include "model/coating.h"
#include "model/fresnel_dielectric.h"
#include "model/obstacle.h"

/* eta: inside over outside; trapped: R */
#define PLASTIC_NUMBERS(NUMBER)                                         \
  NUMBER(PLASTIC, diffuse_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG)  \
  NUMBER(PLASTIC, specular_reflectance, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(PLASTIC, eta, 1, ROLE_INDEX, COORDINATE_LOG)                   \
  NUMBER(PLASTIC, nonlinear, 1, ROLE_FIXED, COORDINATE_ITSELF)          \
  NUMBER(PLASTIC, trapped, 1, ROLE_FACTOR, COORDINATE_ITSELF)
#define PLASTIC_PARAMETERS(PARAMETER)                  \
  PARAMETER(diffuse_reflectance, REFLECTANCE, 0.5, "") \
  PARAMETER(specular_reflectance, REFLECTANCE, 1, "")  \
  PARAMETER(int_ior, INDEX, 1.49, "")                  \
  PARAMETER(ext_ior, INDEX, 1.000277, "")              \
  PARAMETER(nonlinear, FLAG, 0, "")
#define PLASTIC_TRAITS BSDF_PARTLY_SMOOTH
#define PLASTIC_RANDOM 3
enum { PLASTIC_NUMBERS(DECLARE_SLOT) PLASTIC_SLOTS };

MODEL plastic_mirror(const REAL* n, REAL3 w) { return fresnel_dielectric(MIN(ABS(w.z), NUMBER(1)), n[PLASTIC_eta]); }

MODEL plastic_choice(const REAL* n, REAL3 wi) {
  return coating_choice(n + PLASTIC_specular_reflectance, n + PLASTIC_diffuse_reflectance,
                        NUMBER(1) - plastic_mirror(n, wi));
}

MODEL_VOID plastic_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL passed =
      SELECT(wi.z > NUMBER(0), (NUMBER(1) - plastic_mirror(n, wi)) * (NUMBER(1) - plastic_mirror(n, wo)), NUMBER(0));
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    f[c] = coating_base(n[PLASTIC_diffuse_reflectance + c], passed, n[PLASTIC_eta], n[PLASTIC_trapped],
                        n[PLASTIC_nonlinear], wo);
}

MODEL plastic_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  return SELECT(wi.z > NUMBER(0), (NUMBER(1) - plastic_choice(n, wi)) * diffuse_pdf(wo), NUMBER(0));
}

MODEL_VOID plastic_chosen(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) f[c] = plastic_mirror(n, wi) * n[PLASTIC_specular_reflectance + c];
}

/* The mirror's direction is chosen if u0 is below its probability. */
MODEL_VOID plastic_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                        REAL* inverse_eta) {
  REAL choice = plastic_choice(n, wi);
  MASK mirror = u[0] < choice;
  REAL3 from_base = diffuse_sample(u[1], u[2]);
  *wo =
      make3(SELECT(mirror, -wi.x, from_base.x), SELECT(mirror, -wi.y, from_base.y), SELECT(mirror, wi.z, from_base.z));
  *pdf = SELECT(mirror, NUMBER(0), plastic_density(variant, n, wi, *wo));
  *inverse_eta = NUMBER(1);
  REAL f[CHANNELS], chosen[CHANNELS];
  plastic_value(variant, n, wi, *wo, f);
  plastic_chosen(variant, n, wi, *wo, chosen);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] = SELECT(mirror, chosen[c] / MAX(choice, NUMBER(1e-20)), f[c] / MAX(*pdf, NUMBER(1e-20)));
}

BSDF_DECIDES_DIRECTION(plastic)

#ifndef __OPENCL_VERSION__
MODEL_VOID plastic_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int k = 0; k < 6; ++k) n[k] = parameters[k];
  n[PLASTIC_eta] = parameters[6] / parameters[7];
  n[PLASTIC_nonlinear] = parameters[8];
  n[PLASTIC_trapped] = fresnel_diffuse_reflectance(NUMBER(1) / n[PLASTIC_eta]);
}
inline Refusal plastic_refusal(const double* parameters) { return equal_indices_refusal(parameters[6], parameters[7]); }
inline const char* plastic_obstacle(const double* parameters, int slot) {
  return slot < 6 ? unless_zero(parameters[slot]) : coating_obstacle(parameters[6], parameters[7]);
}
#endif

#endif
