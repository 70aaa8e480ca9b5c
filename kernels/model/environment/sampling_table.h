/* Directions drawn cell by cell: for lights that are brighter here than there. Filled by append_sampling
 * (runtime/render/compile/environment.h). */
#ifndef ITN_ENVIRONMENT_SAMPLING_TABLE_H
#define ITN_ENVIRONMENT_SAMPLING_TABLE_H
#include "shared/vector.h"

/* Sampling tables: cdf[0] = 0 <= ... <= cdf[n] = 1, multiples of 2^-24 like the random numbers, so that the probability of
 * a cell is the difference of its bounds exactly. Rows come first, then each row's columns. */

/* The cell of u; u becomes its place in the cell, [0, 1). */
static inline INT pick_cell(__global const float* tables, INT cdf, int n, REAL* u, REAL* probability) {
  int step = 1;
  while (2 * step < n) step *= 2;
  INT cell = 0;
  for (; step > 0; step /= 2) {
    const INT next = min(cell + step, (INT)(n - 1));
    cell = SELECT_INT(GATHER(tables, cdf + next) <= *u, next, cell);
  }
  const REAL low = GATHER(tables, cdf + cell), high = GATHER(tables, cdf + cell + 1);
  *probability = high - low;
  *u = fmin((*u - low) / *probability, (REAL)0.99999994f);
  return cell;
}

static inline REAL cell_probability(__global const float* tables, int rows_cdf, int rows, int columns, INT row,
                                    INT column) {
  const INT at = rows_cdf + row;
  const INT along = rows_cdf + (rows + 1) + row * (columns + 1) + column;
  return (GATHER(tables, at + 1) - GATHER(tables, at)) * (GATHER(tables, along + 1) - GATHER(tables, along));
}

#endif
