/* Draine's phase function [1/sr]: Henyey-Greenstein's, times a square of the cosine
 *
 *   p(c; g, alpha) = (1 - g^2) / (4 pi (1 + g^2 - 2 g c)^(3/2)) * (1 + alpha c^2) / (1 + alpha (1 + 2 g^2) / 3)
 *
 * c: cosine of the angle between the directions of travel before and after the scattering, so c = 1 is straight on.
 * g in (-1, 1), which is the mean of c only where alpha is 0; alpha >= 0. alpha 0: Henyey-Greenstein; alpha 1:
 * Cornette and Shanks; alpha 1 and g 0: Rayleigh. The sampler is exact but for rounding.
 *   Draine 2003, "Scattering by interstellar dust grains. I. Optical and ultraviolet", doi:10.1086/379118
 *   Fog and clouds by it: Jendersie, d'Eon 2023, doi:10.1145/3587421.3595409; their sampler divides by g, ours does not
 * Tests: tests/model/phase_draine_test.cpp */
#ifndef ITN_PHASE_DRAINE_H
#define ITN_PHASE_DRAINE_H
#include "model/phase/henyey_greenstein.h"

#define DRAINE_NUMBERS(NUMBER)                          \
  NUMBER(DRAINE, g, 1, ROLE_DENSITY, COORDINATE_COSINE) \
  NUMBER(DRAINE, alpha, 1, ROLE_DENSITY, COORDINATE_ITSELF)
#define DRAINE_PARAMETERS(PARAMETER) \
  PARAMETER(g, COSINE, 0.8, "")      \
  PARAMETER(alpha, NON_NEGATIVE, 1, "")
enum { DRAINE_NUMBERS(DECLARE_SLOT) DRAINE_SLOTS };

MODEL draine(REAL c, REAL g, REAL alpha) {
  return henyey_greenstein(c, g) * (NUMBER(1) + alpha * c * c) /
         (NUMBER(1) + alpha * (NUMBER(1) + NUMBER(2) * g * g) * NUMBER(1.0 / 3));
}

/* The sampler asks which quantile v of Henyey-Greenstein's distribution has the cosine that is u's here. With
 * k = alpha / (1 + alpha), 1 + alpha c^2 is in proportion to 1 - k (1 - c^2), so that v is the root of
 *   v - k B(v) = u (1 - k B(1)),   B(v): the integral of 1 - c^2 over Henyey-Greenstein's quantiles from 0 to v.
 * With p = 1 + g, m = 1 - g, w = 1 - v and s = m w + p v that is
 *   B(v) = 2/3 m p^2 v^2 (3 m w^2 + 2 p (2 - g) w v + p^2 v^2) / s^3,   B(1) = 2/3 m p:
 * positive terms, and no division by g. */
MODEL draine_below(REAL g, REAL k, REAL v) {
  REAL p = NUMBER(1) + g, m = NUMBER(1) - g, w = NUMBER(1) - v;
  REAL s = NUMBER(1) / (m * w + p * v);
  REAL a = p * v;
  REAL sum = NUMBER(3) * m * w * w + NUMBER(2) * (NUMBER(2) - g) * w * a + a * a;
  return v - k * NUMBER(2.0 / 3) * m * a * a * sum * s * s * s;
}

/* One of Halley's steps to the root, of third order: c is the cosine at v, (1 - k) + k c^2 the slope there. */
MODEL draine_step(REAL g, REAL k, REAL least, REAL target, REAL v) {
  REAL p = NUMBER(1) + g, m = NUMBER(1) - g, w = NUMBER(1) - v;
  REAL s = NUMBER(1) / (m * w + p * v);
  REAL c = NUMBER(1) - NUMBER(2) * m * m * w * (NUMBER(1) + g * v) * s * s;
  REAL off = draine_below(g, k, v) - target;
  REAL slope = least + k * c * c;
  REAL half_curvature = NUMBER(2) * k * c * m * m * p * p * s * s * s;
  REAL squared = slope * slope;
  REAL step = off * slope / MAX(squared - off * half_curvature, NUMBER(0.5) * squared);
  return MIN(MAX(v - step, NUMBER(0)), NUMBER(1));
}

/* The value at which the steps begin. The slope is least at the quantile v0 of the right angle. In x = dc/dv (v -
 * v0), as far as the cosine is near x, the equation is x + alpha x^3 / 3 = (1 + alpha) dc/dv (target - below(v0)): for
 * g = 0 the whole of it, solved by a hyperbolic sine. Beyond |x| = 1, where no cosine is, a straight line. Three steps
 * lead from there to rounding, for every g and alpha up to greatest_draine_alpha. */
MODEL draine_first_guess(REAL g, REAL alpha, REAL k, REAL target) {
  REAL q = (NUMBER(1) - g) * (NUMBER(1) + g), r = SQRT(NUMBER(1) + g * g);
  REAL v0 = NUMBER(0.5) - NUMBER(0.5) * g * (NUMBER(3) - g * g) / (r * (q + r));
  REAL dc = NUMBER(2) * r * r * r / q;
  REAL off = (target - draine_below(g, k, v0)) * dc;
  REAL size = ABS(off);
  REAL a = MAX(alpha, NUMBER(1e-3)), root = SQRT(a);
  REAL z = NUMBER(1.5) * size * (NUMBER(1) + a) * root;
  REAL e = EXP(LOG(z + SQRT(z * z + NUMBER(1))) * NUMBER(1.0 / 3));
  REAL inside = MIN((e - NUMBER(1) / e) / root, NUMBER(1));
  REAL outside = MAX(size - (NUMBER(1) + a * NUMBER(1.0 / 3)) / (NUMBER(1) + a), NUMBER(0));
  REAL x = inside + outside;
  return MIN(MAX(v0 + SELECT(off < NUMBER(0), -x, x) / dc, NUMBER(0)), NUMBER(1));
}

/* The quantile v of Henyey-Greenstein's distribution whose cosine is that of u here. */
MODEL draine_quantile(REAL g, REAL alpha, REAL u) {
  REAL least = NUMBER(1) / (NUMBER(1) + alpha);
  REAL k = alpha * least;
  REAL target = u * (NUMBER(1) - k * NUMBER(2.0 / 3) * (NUMBER(1) - g) * (NUMBER(1) + g));
  REAL v = draine_first_guess(g, alpha, k, target);
  UNROLL_FOR(int i = 0; i < 3; ++i) v = draine_step(g, k, least, target, v);
  return v;
}

/* Cosine and sine, from u uniform in (0, 1). */
MODEL_VOID draine_sample(REAL g, REAL alpha, REAL u, REAL* c, REAL* sine) {
  henyey_greenstein_sample(g, draine_quantile(g, alpha, u), c, sine);
}

MODEL draine_value(const REAL* n, REAL cosine) { return draine(cosine, n[DRAINE_g], n[DRAINE_alpha]); }

MODEL_VOID draine_draw(const REAL* n, REAL u, REAL* cosine, REAL* sine) {
  draine_sample(n[DRAINE_g], n[DRAINE_alpha], u, cosine, sine);
}

MODEL draine_mean_cosine(const REAL* n) {
  REAL g = n[DRAINE_g], third = n[DRAINE_alpha] * NUMBER(1.0 / 3), fifth = n[DRAINE_alpha] * NUMBER(0.2);
  return g * (NUMBER(1) + fifth * (NUMBER(3) + NUMBER(2) * g * g)) /
         (NUMBER(1) + third * (NUMBER(1) + NUMBER(2) * g * g));
}

#ifndef __OPENCL_VERSION__
inline constexpr double greatest_draine_alpha = 1e6; /* the light at right angles, which it takes away, is 1e-6 then */

MODEL_VOID draine_numbers(const REAL* parameters, REAL* n) {
  henyey_greenstein_numbers(parameters, n);
  n[DRAINE_alpha] = smaller(parameters[1], REAL(greatest_draine_alpha));
}
inline const char* draine_obstacle(const double* parameters, int slot) {
  if (slot == DRAINE_g) return henyey_greenstein_obstacle(parameters, slot);
  return parameters[1] > greatest_draine_alpha ? "alpha above 1e6 is rendered as 1e6" : differentiable;
}
#endif

#endif
