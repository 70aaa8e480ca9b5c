/* Unpolarised Fresnel reflectance of a smooth interface between two dielectrics [1]
 *
 *   F = (rs^2 + rp^2) / 2,  rs = (ci - eta ct) / (ci + eta ct),  rp = (eta ci - ct) / (eta ci + ct),
 *   ct^2 = 1 - (1 - ci^2) / eta^2  (Snell);  F = 1 and ct = 0 where ct^2 <= 0 (total internal reflection)
 *
 * ci in [0, 1]: cosine of incidence. ct in [0, 1]: cosine of refraction. eta > 0: refractive index of the far side over
 * that of the near side.
 *   Born, Wolf, "Principles of Optics", 7th ed., 1.5.2
 * Tests: tests/model/fresnel_dielectric_test.cpp */
#ifndef ITN_FRESNEL_DIELECTRIC_H
#define ITN_FRESNEL_DIELECTRIC_H
#include "shared/portable.h"

/* Relative index as a ray sees it whose direction, leaving the surface, has the cosine cos_i to the outward normal;
 * eta: inside over outside. */
MODEL far_over_near(REAL eta, REAL cos_i) { return SELECT(cos_i > NUMBER(0), eta, NUMBER(1) / eta); }

/* (eta ct)^2 = ci^2 + eta^2 - 1; <= 0: total internal reflection. This form is exact for equal indices. */
MODEL fresnel_refracted_square(REAL cos_i, REAL eta) { return cos_i * cos_i + (eta - NUMBER(1)) * (eta + NUMBER(1)); }

/* Reflectance and cosine of refraction. */
MODEL_VOID fresnel_dielectric_refract(REAL cos_i, REAL eta, REAL* reflectance, REAL* cos_t) {
  REAL square = fresnel_refracted_square(cos_i, eta);
  MASK refracted = square > NUMBER(0);
  /* 1 where there is no refraction keeps the unused branch, and its derivative, finite. */
  REAL t = SQRT(SELECT(refracted, square, NUMBER(1)));
  REAL n = eta * eta * cos_i;
  REAL sum_s = cos_i + t, sum_p = n + t;
  REAL s = (cos_i - t) * sum_p, p = (n - t) * sum_s;
  REAL both = MAX(sum_s * sum_p, NUMBER(1e-18)); /* vanishes at grazing incidence on equal indices */
  *reflectance = SELECT(refracted, NUMBER(0.5) * (s * s + p * p) / (both * both), NUMBER(1));
  *cos_t = SELECT(refracted, t / eta, NUMBER(0));
}

MODEL fresnel_dielectric(REAL cos_i, REAL eta) {
  REAL reflectance, cos_t;
  fresnel_dielectric_refract(cos_i, eta, &reflectance, &cos_t);
  return reflectance;
}

#endif
