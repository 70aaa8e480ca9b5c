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
#include "shared/declaration.h"

/* As many values as there may be: all are numbers, by each of which there are derivatives. A table has as many of the
 * parameters as it has values (tabulated_model() of runtime/scene/model.h); of the others, below 0, the numbers are 0. */
#define TABULATED_MOST 32
#define TABULATED_FOUR(NUMBER, a, b, c, d)                      \
  NUMBER(TABULATED, value_##a, 1, ROLE_DENSITY, COORDINATE_LOG) \
  NUMBER(TABULATED, value_##b, 1, ROLE_DENSITY, COORDINATE_LOG) \
  NUMBER(TABULATED, value_##c, 1, ROLE_DENSITY, COORDINATE_LOG) \
  NUMBER(TABULATED, value_##d, 1, ROLE_DENSITY, COORDINATE_LOG)
#define TABULATED_FOUR_VALUES(PARAMETER, a, b, c, d) \
  PARAMETER(value_##a, NON_NEGATIVE, 1, "")          \
  PARAMETER(value_##b, NON_NEGATIVE, 1, "")          \
  PARAMETER(value_##c, NON_NEGATIVE, 1, "")          \
  PARAMETER(value_##d, NON_NEGATIVE, 1, "")
#define TABULATED_NUMBERS(NUMBER)        \
  TABULATED_FOUR(NUMBER, 0, 1, 2, 3)     \
  TABULATED_FOUR(NUMBER, 4, 5, 6, 7)     \
  TABULATED_FOUR(NUMBER, 8, 9, 10, 11)   \
  TABULATED_FOUR(NUMBER, 12, 13, 14, 15) \
  TABULATED_FOUR(NUMBER, 16, 17, 18, 19) \
  TABULATED_FOUR(NUMBER, 20, 21, 22, 23) \
  TABULATED_FOUR(NUMBER, 24, 25, 26, 27) \
  TABULATED_FOUR(NUMBER, 28, 29, 30, 31) \
  NUMBER(TABULATED, cells, 1, ROLE_FIXED, COORDINATE_ITSELF)
#define TABULATED_PARAMETERS(PARAMETER)            \
  TABULATED_FOUR_VALUES(PARAMETER, 0, 1, 2, 3)     \
  TABULATED_FOUR_VALUES(PARAMETER, 4, 5, 6, 7)     \
  TABULATED_FOUR_VALUES(PARAMETER, 8, 9, 10, 11)   \
  TABULATED_FOUR_VALUES(PARAMETER, 12, 13, 14, 15) \
  TABULATED_FOUR_VALUES(PARAMETER, 16, 17, 18, 19) \
  TABULATED_FOUR_VALUES(PARAMETER, 20, 21, 22, 23) \
  TABULATED_FOUR_VALUES(PARAMETER, 24, 25, 26, 27) \
  TABULATED_FOUR_VALUES(PARAMETER, 28, 29, 30, 31)
enum { TABULATED_NUMBERS(DECLARE_SLOT) TABULATED_SLOTS };

MODEL tabulated_value(const REAL* n, REAL cosine) {
  REAL x = NUMBER(0.5) * n[TABULATED_cells] * MIN(MAX(cosine + NUMBER(1), NUMBER(0)), NUMBER(2));
  REAL value = NUMBER(0);
  UNROLL_FOR(int i = 0; i < TABULATED_MOST; ++i) value = value + n[i] * MAX(NUMBER(1) - ABS(x - NUMBER(i)), NUMBER(0));
  return value;
}

/* The share of the cell from value i on. */
MODEL tabulated_share(const REAL* n, int i) {
  REAL cells = n[TABULATED_cells];
  return SELECT(NUMBER(i) < cells, NUMBER(2 * PI_) * (n[i] + n[i + 1]) / cells, NUMBER(0));
}

MODEL_VOID tabulated_draw(const REAL* n, REAL u, REAL* cosine, REAL* sine) {
  REAL below = NUMBER(0), from = NUMBER(0), left = NUMBER(0), low = n[0], high = n[1], share = NUMBER(1);
  UNROLL_FOR(int i = 0; i < TABULATED_MOST - 1; ++i) {
    REAL own = tabulated_share(n, i);
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
  *cosine = MIN(NUMBER(2) * (left + t) / n[TABULATED_cells] - NUMBER(1), NUMBER(1));
  *sine = SQRT(MAX((NUMBER(1) - *cosine) * (NUMBER(1) + *cosine), NUMBER(0)));
}

MODEL tabulated_mean_cosine(const REAL* n) {
  REAL mean = NUMBER(0), width = NUMBER(2) / n[TABULATED_cells];
  for (int i = 0; i < TABULATED_MOST - 1; ++i) {
    REAL from = NUMBER(i) * width - NUMBER(1);
    REAL sum = from * (n[i] + n[i + 1]) * NUMBER(0.5) + width * (n[i] + NUMBER(2) * n[i + 1]) * NUMBER(1.0 / 6);
    mean = mean + SELECT(NUMBER(i) < n[TABULATED_cells], NUMBER(2 * PI_) * width * sum, NUMBER(0));
  }
  return mean;
}

#ifndef __OPENCL_VERSION__
MODEL_VOID tabulated_numbers(const REAL* parameters, REAL* n) {
  REAL cells = NUMBER(-1), sum = NUMBER(0);
  for (int i = 0; i < TABULATED_MOST; ++i) {
    MASK is = !(parameters[i] < NUMBER(0));
    cells = cells + SELECT(is, NUMBER(1), NUMBER(0));
    n[i] = SELECT(is, parameters[i], NUMBER(0));
  }
  n[TABULATED_cells] = cells;
  for (int i = 0; i < TABULATED_MOST - 1; ++i) sum = sum + tabulated_share(n, i);
  for (int i = 0; i < TABULATED_MOST; ++i) n[i] = n[i] / sum;
}
inline const char* tabulated_obstacle(const double* parameters, int slot) { return unless_zero(parameters[slot]); }
#endif

#endif
