/* log, exp, sine and cosine over REAL, without branches or tables: the same few multiply-adds on a GPU and on every
 * lane of a CPU, where the library's versions go through the lanes one by one. OpenCL C only; included by
 * shared/portable.h.
 *
 * Polynomials: minimax fits (Lawson's reweighted least squares) made for this file; the errors stated are measured by
 * tests/model/elementary_test.cpp. */
#ifndef ITN_ELEMENTARY_H
#define ITN_ELEMENTARY_H

/* Natural logarithm of x >= 0; 3 ulp for normal x. Zero and denormal x give values in (-88.1, -87.3), so -log(x) stays
 * a usable optical depth; infinity gives 88.7. Negative x and NaN: undefined. */
INLINE REAL real_log(REAL x) {
  INT bits = AS_INT(x);
  /* x = 2^e (1 + f), 1 + f in [sqrt(1/2), sqrt(2)): subtracting the bits of sqrt(1/2) leaves e in the exponent. */
  INT e = (bits - 0x3f3504f3) >> 23;
  REAL f = AS_REAL(bits - (e << 23)) - 1.0f;
  f = SELECT(bits < 0x00800000, 0.0f, f);
  REAL p = NUMBER(-7.634497757e-2);
  p = p * f + 1.276157754e-1f;
  p = p * f - 1.316018216e-1f;
  p = p * f + 1.420175792e-1f;
  p = p * f - 1.662335736e-1f;
  p = p * f + 2.000122688e-1f;
  p = p * f - 2.500082103e-1f;
  p = p * f + 3.333333171e-1f;
  REAL f2 = f * f;
  return CAST_REAL(e) * 0.69314718056f + (f + (f * f2 * p - 0.5f * f2));
}

/* e^x, 2 ulp. x < -87.3 gives 0; x > 88.3 gives e^88.3 = 2.2e38, never infinity. NaN: undefined. */
INLINE REAL real_exp(REAL x) {
  REAL y = fmin(fmax(x, (REAL)(-87.3f)), (REAL)(88.3f));
  INT k = CAST_INT(y * 1.44269504089f + SELECT(y < 0.0f, -0.5f, 0.5f));
  REAL n = CAST_REAL(k);
  REAL r = (y - n * 0.693359375f) + n * 2.12194440e-4f; /* ln 2 = 0.693359375 - 2.1219444e-4, the first exact in n */
  REAL p = NUMBER(1.381446689e-3);
  p = p * r + 8.368780415e-3f;
  p = p * r + 4.166839421e-2f;
  p = p * r + 1.666652011e-1f;
  p = p * r + 4.999999341e-1f;
  p = p * r * r + r + 1.0f;
  return SELECT(x < -87.3f, 0.0f, AS_REAL(AS_INT(p) + (k << 23)));
}

/* *s = sin(2 pi x), *c = cos(2 pi x) for x in [0, 1]; absolute error 1e-7. */
INLINE void sin_cos_2pi(REAL x, REAL* s, REAL* c) {
  INT quarter = CAST_INT(x * 4.0f + 0.5f);
  REAL r = x - CAST_REAL(quarter) * 0.25f; /* exact; in [-1/8, 1/8] */
  REAL r2 = r * r;
  REAL sine = NUMBER(-75.39356273);
  sine = sine * r2 + 81.59235355f;
  sine = sine * r2 - 41.34166145f;
  sine = (sine * r2 + 6.283185287f) * r;
  REAL cosine = NUMBER(59.22924409);
  cosine = cosine * r2 - 85.44323629f;
  cosine = cosine * r2 + 64.93932185f;
  cosine = (cosine * r2 - 19.73920868f) * r2 + 1.0f;
  MASK odd = (quarter & 1) != 0;
  REAL a = SELECT(odd, cosine, sine);
  REAL b = SELECT(odd, sine, cosine);
  *s = AS_REAL(AS_INT(a) ^ ((quarter & 2) << 30)); /* the second half turn: negative sine */
  *c = AS_REAL(AS_INT(b) ^ (((quarter + 1) & 2) << 30));
}

#endif
