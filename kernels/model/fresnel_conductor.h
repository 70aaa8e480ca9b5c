/* Unpolarised Fresnel reflectance of a smooth interface from vacuum to a conductor [1]
 *
 *   index of refraction eta + i k relative to the outside, eta >= 0, k >= 0; ci in [0, 1]: cosine of incidence
 *   with t = eta^2 - k^2 - si^2, q = sqrt(t^2 + 4 eta^2 k^2), a = sqrt((q + t) / 2):
 *   Rs = (q - 2 a ci + ci^2) / (q + 2 a ci + ci^2)
 *   Rp = Rs (ci^2 q - 2 a ci si^2 + si^4) / (ci^2 q + 2 a ci si^2 + si^4)
 *   F = (Rs + Rp) / 2
 *
 *   Born, Wolf, "Principles of Optics", 7th ed., 14.2 (reflection from metals)
 * Tests: tests/model/rough_conductor_test.cpp */
#ifndef ITN_FRESNEL_CONDUCTOR_H
#define ITN_FRESNEL_CONDUCTOR_H
#include "shared/portable.h"

MODEL fresnel_conductor(REAL ci, REAL eta, REAL k) {
  REAL c2 = ci * ci, s2 = NUMBER(1) - c2;
  REAL t = eta * eta - k * k - s2;
  REAL q = SQRT(t * t + NUMBER(4) * eta * eta * k * k);
  /* (q + t) / 2 as a quotient where t is negative: no difference of large numbers. The least value keeps the root's
   * derivative finite; the reflectance does not feel it. */
  REAL half_sum =
      SELECT(t > NUMBER(0), NUMBER(0.5) * (q + t), NUMBER(2) * eta * eta * k * k / MAX(q - t, NUMBER(1e-12)));
  REAL a = SQRT(MAX(half_sum, NUMBER(1e-12)));
  REAL p = NUMBER(2) * a * ci;
  REAL rs = (q + c2 - p) / (q + c2 + p);
  REAL u = c2 * q + s2 * s2, v = p * s2;
  REAL rp = rs * (u - v) / MAX(u + v, NUMBER(1e-20));
  return NUMBER(0.5) * (rs + rp);
}

#endif
