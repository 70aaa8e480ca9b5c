/* von Mises-Fisher phase function [1/sr]
 *
 *   p(c; kappa) = kappa exp(kappa (c - 1)) / (2 pi (1 - exp(-2 kappa)))
 *
 * c: cosine of the angle between the directions of travel before and after the scattering, so c = 1 is straight on.
 * kappa > 0: concentration; near 0 isotropic. Its mean cosine is coth kappa - 1 / kappa. This form neither overflows
 * for large kappa nor divides 0 by 0 for small ones. The sampler is exact: its density is p.
 *   Fisher 1953, "Dispersion on a sphere", doi:10.1098/rspa.1953.0064; Ulrich 1984 for the sampler
 * Tests: tests/model/phase_vmf_test.cpp */
#ifndef ITN_PHASE_VMF_H
#define ITN_PHASE_VMF_H
#include "model/obstacle.h"
#include "shared/declaration.h"

#define VMF_NUMBERS(NUMBER) NUMBER(VMF, kappa, 1, ROLE_DENSITY, COORDINATE_LOG)
#define VMF_PARAMETERS(PARAMETER) PARAMETER(kappa, CONCENTRATION, 10, "")
enum { VMF_NUMBERS(DECLARE_SLOT) VMF_SLOTS };

/* 1 - exp(-x), x >= 0, with its digits where x is small: the series of five terms is exact to 1e-8 up to x = 0.05 */
MODEL vmf_one_minus_exp(REAL x) {
  REAL series = x * (NUMBER(1) - x * NUMBER(0.5) *
                                     (NUMBER(1) - x * NUMBER(1.0 / 3) *
                                                      (NUMBER(1) - x * NUMBER(0.25) * (NUMBER(1) - x * NUMBER(0.2)))));
  return SELECT(x < NUMBER(0.05), series, NUMBER(1) - EXP(-x));
}

/* A c that rounding has put beyond 1 counts as 1. */
MODEL vmf(REAL c, REAL kappa) {
  REAL below = MIN(c, NUMBER(1)) - NUMBER(1);
  return NUMBER(0.159154943091895336) * kappa * EXP(kappa * below) / vmf_one_minus_exp(NUMBER(2) * kappa);
}

/* Cosine and sine, from u uniform in (0, 1). The inverse of the cumulative distribution is
 *   1 - c = -log(1 - v (1 - exp(-2 kappa))) / kappa,  v = 1 - u. */
MODEL_VOID vmf_sample(REAL kappa, REAL u, REAL* c, REAL* sine) {
  REAL v = (NUMBER(1) - u) * vmf_one_minus_exp(NUMBER(2) * kappa);
  /* -log(1 - v), with its digits where v is small */
  REAL series = v * (NUMBER(1) + v * (NUMBER(0.5) + v * (NUMBER(1.0 / 3) + v * (NUMBER(0.25) + v * NUMBER(0.2)))));
  REAL fall = MIN(SELECT(v < NUMBER(0.05), series, -LOG(NUMBER(1) - v)) / kappa, NUMBER(2));
  *c = NUMBER(1) - fall;
  *sine = SQRT(MAX(fall * (NUMBER(2) - fall), NUMBER(0)));
}

MODEL vmf_value(const REAL* n, REAL cosine) { return vmf(cosine, n[VMF_kappa]); }

MODEL_VOID vmf_draw(const REAL* n, REAL u, REAL* cosine, REAL* sine) { vmf_sample(n[VMF_kappa], u, cosine, sine); }

MODEL vmf_mean_cosine(const REAL* n) {
  REAL kappa = n[VMF_kappa];
  REAL e = EXP(NUMBER(-2) * kappa);
  REAL exact = (NUMBER(1) + e) / (NUMBER(1) - e) - NUMBER(1) / kappa;
  return SELECT(kappa < NUMBER(1e-3), kappa * NUMBER(1.0 / 3), exact);
}

#ifndef __OPENCL_VERSION__
MODEL_VOID vmf_numbers(const REAL* parameters, REAL* n) { n[0] = parameters[0]; }
inline const char* vmf_obstacle(const double*, int) { return differentiable; }
#endif

#endif
