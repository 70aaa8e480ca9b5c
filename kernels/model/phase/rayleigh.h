/* Rayleigh phase function [1/sr]: particles much smaller than the wavelength, unpolarised light
 *
 *   p(c) = 3 / (16 pi) (1 + c^2)
 *
 * c: cosine of the angle between the directions of travel before and after the scattering. The sampler is exact.
 *   Frisvad 2011, "Importance sampling the Rayleigh phase function", doi:10.1364/JOSAA.28.002436, for the sampler
 * Tests: tests/model/phase_rayleigh_test.cpp */
#ifndef ITN_PHASE_RAYLEIGH_H
#define ITN_PHASE_RAYLEIGH_H
#include "model/obstacle.h"
#include "shared/declaration.h"

#define RAYLEIGH_NUMBERS(NUMBER)
#define RAYLEIGH_PARAMETERS(PARAMETER)
enum { RAYLEIGH_NUMBERS(DECLARE_SLOT) RAYLEIGH_SLOTS };

MODEL rayleigh_value(const REAL* n, REAL cosine) {
  return NUMBER(0.0596831036594607510) * (NUMBER(1) + cosine * cosine);
}

/* The inverse of the cumulative distribution (4 + 3 c + c^3) / 8 is
 *   c = 2 sinh(asinh(z) / 3),  z = 4 u - 2:
 * of |z|, so that the sum under the logarithm keeps its digits. */
MODEL_VOID rayleigh_draw(const REAL* n, REAL u, REAL* cosine, REAL* sine) {
  REAL z = NUMBER(4) * u - NUMBER(2);
  REAL a = ABS(z);
  REAL root = EXP(LOG(a + SQRT(a * a + NUMBER(1))) * NUMBER(1.0 / 3));
  REAL size = MIN(root - NUMBER(1) / root, NUMBER(1));
  *cosine = SELECT(z < NUMBER(0), -size, size);
  *sine = SQRT((NUMBER(1) - size) * (NUMBER(1) + size));
}

MODEL rayleigh_mean_cosine(const REAL* n) { return NUMBER(0); }

#ifndef __OPENCL_VERSION__
MODEL_VOID rayleigh_numbers(const REAL*, REAL*) {}
inline const char* rayleigh_obstacle(const double*, int) { return differentiable; }
#endif

#endif
