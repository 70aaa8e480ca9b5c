/* A diffuse base under a dielectric coating, as Mitsuba 3's plastics have it.
 *
 *   f |cos wo| = T(wi) T(wo) |wo.z| / (pi eta^2) r / (1 - R (nonlinear ? r : 1)) [1/sr]
 *
 * T: share of the light that the coating lets pass, at the angles outside; eta: index inside over outside; r:
 * reflectance of the base; R, `trapped`: share of diffuse light from inside that the coating reflects back to the
 * base.
 *
 * A sample is of the coating with probability (1 - T) s / ((1 - T) s + T r), s: the coating's factor
 * specular_reflectance, both the mean of their channels where the path is.
 * Tests: tests/model/plastics_test.cpp */
#ifndef ITN_COATING_H
#define ITN_COATING_H
#include "model/bsdf/diffuse.h"
#include "shared/declaration.h"

/* Light that the base sends to wi, of reflectance r; passed: T(wi) T(wo). */
MODEL coating_base(REAL r, REAL passed, REAL eta, REAL trapped, REAL nonlinear, REAL3 wo) {
  REAL darkening = NUMBER(1) - trapped * (NUMBER(1) + nonlinear * (r - NUMBER(1)));
  return r * (diffuse_pdf(wo) * passed / (eta * eta)) / darkening;
}

MODEL mean_of_channels(const REAL* colour) {
  REAL sum = colour[0];
  UNROLL_FOR(int c = 1; c < CHANNELS; ++c) sum += colour[c];
  return sum * NUMBER(1.0 / CHANNELS);
}

/* Probability that a sample is of the coating. */
MODEL coating_choice(const REAL* specular, const REAL* diffuse, REAL passes) {
  REAL coating = (NUMBER(1) - MIN(passes, NUMBER(1))) * mean_of_channels(specular);
  REAL base = passes * mean_of_channels(diffuse);
  return coating / MAX(coating + base, NUMBER(1e-20));
}

#ifndef __OPENCL_VERSION__
/* Share of diffuse light that a smooth interface reflects; eta: far over near index. Fits, as in Mitsuba, so that
 * values agree:
 *   eta < 1: Egan, Hilgeman 1973, within 0.1 % for 1/eta < 1.5, 0.6 % for 1/eta < 2, 10 % for 1/eta < 5
 *   else: d'Eon, Irving 2011, "A quantized-diffusion model for rendering translucent materials", within 0.2 % below 10 */
MODEL fresnel_diffuse_reflectance(REAL eta) {
  REAL inside = NUMBER(-1.4399) * eta * eta + NUMBER(0.7099) * eta + NUMBER(0.6681) + NUMBER(0.0636) / eta;
  REAL x = NUMBER(1) / eta;
  REAL outside = NUMBER(0.919317) +
                 x * (NUMBER(-3.4793) +
                      x * (NUMBER(6.75335) + x * (NUMBER(-7.80989) + x * (NUMBER(4.98554) - x * NUMBER(1.36881)))));
  return SELECT(eta < NUMBER(1), inside, outside);
}

inline Refusal equal_indices_refusal(double int_ior, double ext_ior) {
  if (int_ior != ext_ior) return {};
  return {"int_ior", "and ext_ior are both", int_ior, "need different ones: without a coating use diffuse"};
}
inline const char* coating_obstacle(double int_ior, double ext_ior) {
  const double ratio = int_ior / ext_ior;
  if (ratio - 1 < 1e-4 && 1 - ratio < 1e-4) return "the two indices are nearly equal: without a coating use diffuse";
  return ratio < 1e-3 || ratio > 1e3 ? "the ratio of the two indices is beyond 1000" : differentiable;
}
#endif

#endif
