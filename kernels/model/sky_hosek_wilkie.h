/* Radiance of the clear sky, one colour channel [W/(m^2 sr), scaled as Mitsuba 3 scales it]
 *
 *   L(theta, gamma) = M (1 + A e^(B / (cos theta + 0.01)))
 *                       (C + D e^(E gamma) + F cos^2 gamma + G (1 + cos^2 gamma) / (1 + H^2 - 2 H cos gamma)^(3/2)
 *                        + I sqrt(cos theta))
 *
 * theta: angle from the zenith, up to pi/2; gamma: angle from the sun. k holds A B C D E F G I H M, in the order of the
 * published tables; what makes them out of turbidity, ground albedo and the sun's elevation is
 * runtime/scene/sky/hosek_wilkie.cpp. A channel may come out negative. L is linear in C D F G I M.
 *   Hosek, Wilkie 2012, "An analytic model for full spectral sky-dome radiance", doi:10.1145/2185520.2185591
 * Tests: tests/scene/environment_test.cpp, tests/kernel/environment_test.cpp */
#ifndef ITN_SKY_HOSEK_WILKIE_H
#define ITN_SKY_HOSEK_WILKIE_H
#include "shared/portable.h"

/* e^x - 1 without cancellation about 0: its Taylor series up to |x| = 1/2 (relative error 5e-10). */
MODEL exp_minus_one(REAL x) {
  REAL p = NUMBER(1.0 / 362880);
  p = p * x + NUMBER(1.0 / 40320);
  p = p * x + NUMBER(1.0 / 5040);
  p = p * x + NUMBER(1.0 / 720);
  p = p * x + NUMBER(1.0 / 120);
  p = p * x + NUMBER(1.0 / 24);
  p = p * x + NUMBER(1.0 / 6);
  p = p * x + NUMBER(1.0 / 2);
  p = p * x + NUMBER(1);
  return SELECT(ABS(x) < NUMBER(0.5), p * x, EXP(x) - NUMBER(1));
}

/* one_minus_cos: of gamma; half the squared distance between the unit vectors has more digits than their dot product */
MODEL sky_hosek_wilkie(const REAL* k, REAL cos_theta, REAL gamma, REAL one_minus_cos) {
  REAL horizon = NUMBER(1) + k[0] * EXP(k[1] / (cos_theta + NUMBER(0.01)));
  /* C and D are large and opposite when E is small: C + D e^x = (C + D) + D (e^x - 1) keeps the digits of their sum */
  REAL glow = (k[2] + k[3]) + k[3] * exp_minus_one(k[4] * gamma);
  REAL cos2 = (NUMBER(1) - one_minus_cos) * (NUMBER(1) - one_minus_cos);
  /* 1 + H^2 - 2 H cos gamma: H may come close to 1 */
  REAL q = (NUMBER(1) - k[8]) * (NUMBER(1) - k[8]) + NUMBER(2) * k[8] * one_minus_cos;
  REAL halo = k[5] * cos2 + k[6] * (NUMBER(1) + cos2) / (q * SQRT(q)) + k[7] * SQRT(cos_theta);
  return k[9] * horizon * (glow + halo);
}

#endif
