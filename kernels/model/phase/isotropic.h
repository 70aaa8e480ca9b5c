/* Isotropic phase function [1/sr]
 *
 *   p(c) = 1 / (4 pi)
 *
 * c: cosine of the angle between the directions of travel before and after the scattering. The sampler is exact.
 * Tests: tests/model/phase_isotropic_test.cpp */
#ifndef ITN_PHASE_ISOTROPIC_H
#define ITN_PHASE_ISOTROPIC_H
#include "model/obstacle.h"
#include "shared/declaration.h"

#define ISOTROPIC_NUMBERS(NUMBER)
#define ISOTROPIC_PARAMETERS(PARAMETER)
enum { ISOTROPIC_NUMBERS(DECLARE_SLOT) ISOTROPIC_SLOTS };

MODEL isotropic_value(const REAL* n, REAL cosine) { return NUMBER(0.0795774715459476679); }

MODEL_VOID isotropic_draw(const REAL* n, REAL u, REAL* cosine, REAL* sine) {
  REAL v = NUMBER(1) - u;
  *cosine = NUMBER(1) - NUMBER(2) * v;
  *sine = NUMBER(2) * SQRT(v * u);
}

MODEL isotropic_mean_cosine(const REAL* n) { return NUMBER(0); }

#ifndef __OPENCL_VERSION__
MODEL_VOID isotropic_numbers(const REAL*, REAL*) {}
inline const char* isotropic_obstacle(const double*, int) { return differentiable; }
#endif

#endif
