/* Rough surfaces as distributions of microfacets: density of normals, shadowing, visible normals. Isotropic.
 *
 *   D(m) [1/sr]   density of microfacet normals; the projected area is 1: integral of D(m) m.z over the hemisphere
 *     GGX         D = alpha^2 / (pi (r^2 + alpha^2 z^2)^2)
 *     Beckmann    D = exp(-r^2 / (alpha^2 z^2)) / (pi alpha^2 z^4)           r^2 = m.x^2 + m.y^2, z = m.z
 *   G1(v) [1]     the fraction of microfacets that v sees (Smith)
 *     GGX         G1 = 2 / (1 + sqrt(1 + alpha^2 tan^2 v))
 *     Beckmann    G1 = (3.535 a + 2.181 a^2) / (1 + 2.276 a + 2.577 a^2) for a = 1 / (alpha tan v) < 1.6, else 1:
 *                 the usual rational fit, within 0.35 % of the exact one, as in Mitsuba, so that images agree
 *   Dv(m) [1/sr]  density of the normals visible from wi: Dv = G1(wi) D(m) max(wi.m, 0) / wi.z
 *
 * m, wi: unit, in the frame of the surface, z > 0. alpha > 0: roughness; for Beckmann the RMS slope times sqrt(2).
 * The samplers follow the exact Dv. For Beckmann the fit of G1 puts the Dv stated here off by a factor that depends on
 * wi alone, within 0.35 %; GGX has no such error.
 *   Walter, Marschner, Li, Torrance 2007, "Microfacet models for refraction through rough surfaces"
 *   Heitz, d'Eon 2014, "Importance sampling microfacet-based BSDFs using the distribution of visible normals"
 *   Dupuy, Benyoub 2023, "Sampling visible GGX normals with spherical caps", doi:10.1111/cgf.14867
 * Tests: tests/model/microfacet_test.cpp */
#ifndef ITN_MICROFACET_H
#define ITN_MICROFACET_H
#include "shared/portable.h"

/* Values of distribution, uniform over the lanes. */
#define MICROFACET_BECKMANN 0
#define MICROFACET_GGX 1

MODEL ggx_normals(REAL3 m, REAL alpha) {
  REAL a2 = alpha * alpha;
  REAL d = m.x * m.x + m.y * m.y + a2 * m.z * m.z;
  return a2 / (NUMBER(PI_) * d * d);
}

MODEL ggx_shadowing(REAL3 v, REAL alpha) {
  REAL z2 = v.z * v.z;
  REAL z = ABS(v.z);
  return NUMBER(2) * z / (z + SQRT(z2 + alpha * alpha * (v.x * v.x + v.y * v.y)));
}

MODEL beckmann_normals(REAL3 m, REAL alpha) {
  REAL a2 = alpha * alpha;
  REAL z2 = MAX(m.z * m.z, NUMBER(1e-9));
  return EXP(-(m.x * m.x + m.y * m.y) / (a2 * z2)) / (NUMBER(PI_) * a2 * z2 * z2);
}

MODEL beckmann_shadowing(REAL3 v, REAL alpha) {
  REAL slope = alpha * SQRT(MAX(v.x * v.x + v.y * v.y, NUMBER(1e-20)));
  REAL z = ABS(v.z);
  REAL a = z / MAX(slope, NUMBER(0.5) * z); /* at most 2: where it exceeds 1.6 the fit is not used */
  REAL fit = a * (NUMBER(3.535) + NUMBER(2.181) * a) / (NUMBER(1) + a * (NUMBER(2.276) + NUMBER(2.577) * a));
  return SELECT(a < NUMBER(1.6), fit, NUMBER(1));
}

MODEL microfacet_normals(int distribution, REAL3 m, REAL alpha) {
  if (distribution == MICROFACET_GGX) return ggx_normals(m, alpha);
  return beckmann_normals(m, alpha);
}

MODEL microfacet_shadowing(int distribution, REAL3 v, REAL alpha) {
  if (distribution == MICROFACET_GGX) return ggx_shadowing(v, alpha);
  return beckmann_shadowing(v, alpha);
}

/* Dv(m); wi.z > 0. */
MODEL microfacet_visible_normals(int distribution, REAL3 wi, REAL3 m, REAL alpha) {
  return microfacet_shadowing(distribution, wi, alpha) * microfacet_normals(distribution, m, alpha) *
         MAX(dot3(wi, m), NUMBER(0)) / wi.z;
}

/* A visible normal. Stretched by 1/alpha the microfacets are those of a hemisphere, whose visible normals are half
 * vectors between wi and a direction uniform over a spherical cap. */
MODEL3 ggx_visible_sample(REAL3 wi, REAL alpha, REAL u1, REAL u2) {
  REAL x = alpha * wi.x, y = alpha * wi.y, z = wi.z;
  REAL scale = NUMBER(1) / SQRT(x * x + y * y + z * z);
  REAL height = NUMBER(1) + z * scale; /* of the cap */
  REAL t = u2 * height;                /* 1 - cosine of the direction on the cap */
  REAL radius = SQRT(t * (NUMBER(2) - t));
  REAL s, c;
  sin_cos_2pi(u1, &s, &c);
  REAL hx = alpha * (x * scale + radius * c);
  REAL hy = alpha * (y * scale + radius * s);
  REAL hz = height * (NUMBER(1) - u2); /* = height - t */
  REAL length = NUMBER(1) / SQRT(hx * hx + hy * hy + hz * hz);
  return make3(hx * length, hy * length, hz * length);
}

/* exp(x^2) erfc(x) for x in [0, 4.5], relative error 4e-7; positive and falling beyond. Minimax fit made here. */
MODEL erfc_scaled(REAL x) {
  REAL t = NUMBER(1) / (NUMBER(1) + NUMBER(0.5) * x);
  REAL p = NUMBER(0.09456326351);
  p = p * t - NUMBER(0.3790439687);
  p = p * t + NUMBER(0.4203243755);
  p = p * t + NUMBER(0.01599123742);
  p = p * t + NUMBER(0.2896444922);
  p = p * t + NUMBER(0.2760847539);
  p = p * t + NUMBER(0.2824361776);
  return p * t;
}

/* G1 of Beckmann without the fit: k sqrt(pi) / (k sqrt(pi) erfc(-k) / 2 + exp(-k^2) / 2), k = cot v / alpha. */
MODEL beckmann_shadowing_exact(REAL3 v, REAL alpha) {
  REAL k = MIN(ABS(v.z) / (alpha * SQRT(MAX(v.x * v.x + v.y * v.y, NUMBER(1e-18)))), NUMBER(1e4));
  REAL half_k = NUMBER(0.886226925452758) * k;
  return NUMBER(2) * half_k / (NUMBER(2) * half_k - EXP(-(k * k)) * (half_k * erfc_scaled(k) - NUMBER(0.5)));
}

/* Density of the normals that microfacet_visible_sample draws [1/sr], m.wi > 0; wi and m both above the surface or both
 * below. For Beckmann this is not microfacet_visible_normals, which has the fit of G1. */
MODEL microfacet_visible_density(int distribution, REAL3 wi, REAL3 m, REAL alpha) {
  REAL seen = ABS(dot3(wi, m) / wi.z);
  if (distribution == MICROFACET_GGX) return ggx_shadowing(wi, alpha) * ggx_normals(m, alpha) * seen;
  return beckmann_shadowing_exact(wi, alpha) * beckmann_normals(m, alpha) * seen;
}

/* x with erfc(x) = 2 u for u in [2^-24, 1 - 2^-24], relative error 4e-5: a normal deviate of variance 1/2, x > 0 for
 * u < 1/2. Minimax fit made here. */
MODEL normal_quantile(REAL u) {
  REAL s = SQRT(MAX(-LOG(NUMBER(4) * u * (NUMBER(1) - u)), NUMBER(0)) + NUMBER(0.5));
  REAL p = NUMBER(6.551777119e-4);
  p = p * s - NUMBER(0.01227924567);
  p = p * s + NUMBER(0.09442602273);
  p = p * s - NUMBER(0.3800392269);
  p = p * s + NUMBER(0.8479742438);
  p = p * s - NUMBER(1.070884016);
  p = p * s + NUMBER(1.020874401);
  p = p * s - NUMBER(0.323320621);
  p = p * s + NUMBER(0.8274327961);
  return p * (NUMBER(1) - NUMBER(2) * u);
}

/* A visible normal. Stretched by 1/alpha, slopes are normal deviates of variance 1/2. With q the slope towards wi and
 * k = cot of the stretched wi, visible slopes have density (k + q) exp(-q^2) / n over q > -k, times the same normal
 * density across; so q solves  S(q) = u1 S(-k),  S(q) = k sqrt(pi) erfc(q) / 2 + exp(-q^2) / 2,  n = S(-k).
 *
 * S has closed-form inverses for k = 0 and k = infinity. A blend of the two is within 0.2 of the root for every k; near
 * q = -k, where S is flat, an expansion bounds the root from below; two Halley steps (third order) then leave an error
 * below 1e-6 for u1 < 0.998 and below 3e-4 up to 1 - 2^-24. No branches, no loops that depend on the data. */
MODEL3 beckmann_visible_sample(REAL3 wi, REAL alpha, REAL u1, REAL u2) {
  REAL r2 = wi.x * wi.x + wi.y * wi.y;
  MASK tilted = r2 > NUMBER(1e-18);
  REAL per_r = NUMBER(1) / SQRT(MAX(r2, NUMBER(1e-18)));
  REAL cos_phi = SELECT(tilted, wi.x * per_r, NUMBER(1)), sin_phi = SELECT(tilted, wi.y * per_r, NUMBER(0));
  REAL k = MIN(wi.z * per_r / alpha, NUMBER(1e4));

  REAL half_k = NUMBER(0.886226925452758) * k; /* k sqrt(pi) / 2 */
  REAL exp_k = EXP(-k * k);
  REAL tail_k = exp_k * (half_k * erfc_scaled(k) - NUMBER(0.5)); /* 2 half_k - n */
  REAL n = NUMBER(2) * half_k - tail_k;
  REAL v1 = NUMBER(1) - u1;

  REAL grazing = SQRT(-LOG(u1));
  REAL blend = k * (NUMBER(1.1241) + k) / (k * (k + NUMBER(1.4469)) + NUMBER(1.9163));
  REAL q = grazing + (normal_quantile(u1) - grazing) * blend;
  REAL width2 = NUMBER(2) * n * v1 / MAX(exp_k, NUMBER(1e-30)); /* (q + k)^2 for small q + k, at most */
  REAL width = SQRT(width2);
  REAL least = SELECT(width2 + NUMBER(2) * k * width < NUMBER(0.5), NUMBER(0.7) * width, NUMBER(1e-3) * k);
  q = MAX(q, least - k);
  UNROLL_FOR(int i = 0; i < 2; ++i) {
    /* S of |q|'s tail alone: no difference of large numbers at either end */
    MASK positive = q > NUMBER(0);
    REAL e = EXP(-q * q);
    REAL tail = e * (half_k * erfc_scaled(ABS(q)) + SELECT(positive, NUMBER(0.5), NUMBER(-0.5)));
    REAL excess = SELECT(positive, tail - n * u1, n * v1 + tail_k - tail); /* S(q) - u1 n */
    REAL z = MAX(k + q, NUMBER(1e-6));
    q = MAX(q + excess * z / (z * z * MAX(e, NUMBER(1e-12)) + excess * (NUMBER(0.5) - q * z)), -k);
  }
  REAL across = normal_quantile(u2);

  REAL x = alpha * (q * cos_phi - across * sin_phi);
  REAL y = alpha * (q * sin_phi + across * cos_phi);
  REAL z = NUMBER(1) / SQRT(NUMBER(1) + x * x + y * y);
  return make3(x * z, y * z, z);
}

MODEL3 microfacet_visible_sample(int distribution, REAL3 wi, REAL alpha, REAL u1, REAL u2) {
  if (distribution == MICROFACET_GGX) return ggx_visible_sample(wi, alpha, u1, u2);
  return beckmann_visible_sample(wi, alpha, u1, u2);
}

#endif
