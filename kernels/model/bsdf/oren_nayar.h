/* Oren and Nayar's rough diffuse surface: V-shaped grooves of Lambertian facets, with what bounces between two facets.
 *
 *   f |cos wo| = reflectance / pi wo.z (L1 + L2)  [1/sr]
 *
 * with a the larger and b the smaller angle to the normal, s = alpha^2, alpha the standard deviation of the facets'
 * slope angle [radian]:
 *   L1 = C1 + cos dphi C2(cos dphi) tan b + (1 - |cos dphi|) C3 tan((a + b) / 2)
 *   C1 = 1 - 0.5 s / (s + 0.33)
 *   C2 = 0.45 s / (s + 0.09) (sin a - (cos dphi < 0 ? (2 b / pi)^3 : 0))
 *   C3 = 0.125 s / (s + 0.09) (4 a b / pi^2)^2
 *   L2 = 0.17 reflectance s / (s + 0.13) (1 - cos dphi (2 b / pi)^2)
 *
 * The fit is not exact: of a white surface up to 4.7 % more light comes back than arrives (alpha 0.3, grazing).
 * 0 unless both directions are above the surface. wi, wo: unit, leave the surface, in its frame; dphi: between their
 * azimuths. Samples are cosine-distributed. alpha 0 is Lambert's surface.
 *   Oren, Nayar 1994, "Generalization of Lambert's reflectance model", doi:10.1145/192161.192213 (the full model,
 *   eq. 30)
 * Tests: tests/model/bsdfs_test.cpp, own_surfaces_test.cpp */
#ifndef ITN_OREN_NAYAR_H
#define ITN_OREN_NAYAR_H
#include "model/angle.h"
#include "model/bsdf/diffuse.h"

#define OREN_NAYAR_NUMBERS(NUMBER)                                \
  NUMBER(OREN_NAYAR, reflectance, 3, ROLE_FACTOR, COORDINATE_LOG) \
  NUMBER(OREN_NAYAR, alpha, 1, ROLE_FACTOR, COORDINATE_ITSELF)
#define OREN_NAYAR_PARAMETERS(PARAMETER)       \
  PARAMETER(reflectance, REFLECTANCE, 0.5, "") \
  PARAMETER(alpha, SLOPE_ANGLE, 0.35, "rad")
#define OREN_NAYAR_TRAITS 0
#define OREN_NAYAR_RANDOM 2
enum { OREN_NAYAR_NUMBERS(DECLARE_SLOT) OREN_NAYAR_SLOTS };

MODEL_VOID oren_nayar_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL high = MAX(wi.z, wo.z), low = MIN(wi.z, wo.z); /* cos b, cos a */
  REAL ri = wi.x * wi.x + wi.y * wi.y, ro = wo.x * wo.x + wo.y * wo.y;
  REAL sin_a = SQRT(MAX(ri, ro)), sin_b = SQRT(MIN(ri, ro));
  REAL a = angle_of(sin_a, low) * NUMBER(2 / PI_), b = angle_of(sin_b, high) * NUMBER(2 / PI_);
  REAL cosine = (wi.x * wo.x + wi.y * wo.y) / MAX(SQRT(ri * ro), NUMBER(1e-12)); /* of dphi */
  REAL s = n[OREN_NAYAR_alpha] * n[OREN_NAYAR_alpha], shaded = s / (s + NUMBER(0.09));
  REAL away = SELECT(cosine < NUMBER(0), b * b * b, NUMBER(0));
  REAL once = NUMBER(1) - NUMBER(0.5) * s / (s + NUMBER(0.33)) +
              cosine * NUMBER(0.45) * shaded * (sin_a - away) * sin_b / MAX(high, NUMBER(1e-9)) +
              (NUMBER(1) - MIN(ABS(cosine), NUMBER(1))) * NUMBER(0.125) * shaded * (a * b) * (a * b) * (sin_a + sin_b) /
                  MAX(low + high, NUMBER(1e-9));
  REAL twice = NUMBER(0.17) * s / (s + NUMBER(0.13)) * (NUMBER(1) - cosine * b * b);
  MASK possible = (wi.z > NUMBER(0)) & (wo.z > NUMBER(0));
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) {
    REAL value = diffuse_eval(n[OREN_NAYAR_reflectance + c], wo) * (once + n[OREN_NAYAR_reflectance + c] * twice);
    f[c] = SELECT(possible, MAX(value, NUMBER(0)), NUMBER(0));
  }
}

MODEL oren_nayar_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  return SELECT(wi.z > NUMBER(0), diffuse_pdf(wo), NUMBER(0));
}

MODEL_VOID oren_nayar_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                           REAL* inverse_eta) {
  *wo = diffuse_sample(u[0], u[1]);
  *pdf = oren_nayar_density(variant, n, wi, *wo);
  *inverse_eta = NUMBER(1);
  REAL f[CHANNELS];
  oren_nayar_value(variant, n, wi, *wo, f);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] = SELECT(*pdf > NUMBER(0), f[c] / MAX(*pdf, NUMBER(1e-20)), NUMBER(0));
}

BSDF_DECIDES_DIRECTION(oren_nayar)
BSDF_DRAWS_ALL(oren_nayar)

#ifndef __OPENCL_VERSION__
MODEL_VOID oren_nayar_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int k = 0; k < OREN_NAYAR_SLOTS; ++k) n[k] = parameters[k];
}
inline Refusal oren_nayar_refusal(const double*) { return {}; }
inline const char* oren_nayar_obstacle(const double* parameters, int slot) {
  return slot == OREN_NAYAR_alpha ? differentiable : unless_zero(parameters[slot]);
}
#endif

#endif
