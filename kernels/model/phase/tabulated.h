/* A phase function [1/sr] given by its values at cosines that are the same distance apart, straight between them:
 *
 *   p(c) = (1 - t) n_i + t n_(i+1),   i + t = cells (1 + c) / 2,   cells + 1 values
 *
 * c: cosine of the angle between the directions of travel before and after the scattering: the first value is that of light
 * thrown back, the last of light that goes straight on. Any values from 0 on that are not all 0; the numbers n are these,
 * made to integrate to 1. The sampler is exact: a cell by its share, then the inverse of the cell's quadratic.
 * Agrees with Mitsuba 3's "tabphase".
 * Tests: tests/model/phase_functions_test.cpp, tests/model/phase_tabulated_test.cpp */
#ifndef ITN_PHASE_TABULATED_H
#define ITN_PHASE_TABULATED_H
#include "model/obstacle.h"
#include "model/phase/sized.h"
#include "shared/declaration.h"

/* `values`: how many, a constant wherever these are called. Each size is a model of its own (tabulated_model() of
 * runtime/scene/model/sized_model.h), whose numbers are value_0, value_1, ...; this is the largest. */
#define TABULATED_MOST 128

SIZED_MODEL tabulated_value(int values, const REAL* n, REAL cosine) {
  REAL x = NUMBER(0.5) * NUMBER(values - 1) * MIN(MAX(cosine + NUMBER(1), NUMBER(0)), NUMBER(2));
  REAL value = NUMBER(0);
  UNROLL_FOR(int i = 0; i < values; ++i) value = value + n[i] * MAX(NUMBER(1) - ABS(x - NUMBER(i)), NUMBER(0));
  return value;
}

/* The share of the cell from value i on. */
SIZED_MODEL tabulated_share(int values, const REAL* n, int i) {
  return NUMBER(2 * PI_) * (n[i] + n[i + 1]) / NUMBER(values - 1);
}

SIZED_MODEL_VOID tabulated_draw(int values, const REAL* n, REAL u, REAL* cosine, REAL* sine) {
  REAL below = NUMBER(0), from = NUMBER(0), left = NUMBER(0), low = n[0], high = n[1], share = NUMBER(1);
  UNROLL_FOR(int i = 0; i < values - 1; ++i) {
    REAL own = tabulated_share(values, n, i);
    MASK is = (u >= below) & (own > NUMBER(0));
    left = SELECT(is, NUMBER(i), left);
    from = SELECT(is, below, from);
    low = SELECT(is, n[i], low);
    high = SELECT(is, n[i + 1], high);
    share = SELECT(is, own, share);
    below = below + own;
  }
  REAL r = MIN((u - from) / share, NUMBER(1));
  REAL root = SQRT((NUMBER(1) - r) * low * low + r * high * high);
  REAL t = MIN(r * (low + high) / MAX(low + root, NUMBER(1e-30)), NUMBER(1));
  *cosine = MIN(NUMBER(2) * (left + t) / NUMBER(values - 1) - NUMBER(1), NUMBER(1));
  *sine = SQRT(MAX((NUMBER(1) - *cosine) * (NUMBER(1) + *cosine), NUMBER(0)));
}

SIZED_MODEL tabulated_mean_cosine(int values, const REAL* n) {
  REAL mean = NUMBER(0), width = NUMBER(2) / NUMBER(values - 1);
  for (int i = 0; i < values - 1; ++i) {
    REAL from = NUMBER(i) * width - NUMBER(1);
    REAL sum = from * (n[i] + n[i + 1]) * NUMBER(0.5) + width * (n[i] + NUMBER(2) * n[i + 1]) * NUMBER(1.0 / 6);
    mean = mean + NUMBER(2 * PI_) * width * sum;
  }
  return mean;
}

#ifndef __OPENCL_VERSION__
SIZED_MODEL_VOID tabulated_numbers(int values, const REAL* parameters, REAL* n) {
  REAL sum = NUMBER(0);
  for (int i = 0; i < values - 1; ++i) sum = sum + tabulated_share(values, parameters, i);
  for (int i = 0; i < values; ++i) n[i] = parameters[i] / sum;
}
inline const char* tabulated_obstacle(const double* parameters, int slot) { return unless_zero(parameters[slot]); }
#endif

#endif
