/* A picture of the light from all directions.
 *
 * scale: what its pixels are multiplied by. Agrees with Mitsuba 3's "envmap".
 * Tests: tests/kernel/environment_test.cpp */
#ifndef ITN_ENVIRONMENT_ENVMAP_H
#define ITN_ENVIRONMENT_ENVMAP_H
#include "shared/environment_layout.h"

#define ENVMAP_PARAMETERS(PARAMETER) PARAMETER(scale, NON_NEGATIVE, 1, "")
#define ENVMAP_TRAITS 0
#define ENVMAP_FORMULA ""

#ifdef __OPENCL_VERSION__
#include "model/angle.h"
#include "model/environment/sampling_table.h"

/* Mitsuba 3's convention: y is up, +z is the middle of the picture, -x to the right of it; the first and the last row are the
 * poles themselves, so there are height - 1 steps of polar angle; columns are `width` steps of azimuth about their centres;
 * between pixels the radiance is bilinear in these angles. A cell of the sampling table lies between four pixels. */
static inline void envmap_cell(__global const EnvironmentRecord* record, REAL3 d, INT* row, INT* column, REAL* down,
                               REAL* across) {
  const int width = record->width, height = record->height;
  REAL x = angle_of(d.x, -d.z) * (float)(0.5 / PI_) - 0.5f / width;
  x = (x - floor(x)) * width;
  const REAL y = angle_of(sqrt(d.x * d.x + d.z * d.z), d.y) * (float)(1 / PI_) * (height - 1);
  *column = clamp(CAST_INT(x), (INT)0, (INT)(width - 1)); /* idle lanes may hold any direction */
  *row = clamp(CAST_INT(y), (INT)0, (INT)(height - 2));
  *across = x - CAST_REAL(*column);
  *down = y - CAST_REAL(*row);
}

static inline void envmap_radiance(__global const EnvironmentRecord* record, __global const float* tables, REAL3 d,
                                   REAL rgb[3]) {
  INT row, column;
  REAL down, across;
  envmap_cell(record, d, &row, &column, &down, &across);
  const int stride = 3 * (record->width + 1);
  const INT at = record->values + row * stride + column * 3;
  UNROLL_FOR(int c = 0; c < 3; ++c) {
    const REAL a = GATHER(tables, at + c), b = GATHER(tables, at + (c + 3));
    const REAL e = GATHER(tables, at + (c + stride)), f = GATHER(tables, at + (c + stride + 3));
    rgb[c] =
        record->radiance[c] * ((1 - down) * ((1 - across) * a + across * b) + down * ((1 - across) * e + across * f));
  }
}

/* The pixels that the radiance is a sum of, row by row without the column that repeats, and their weights. */
static inline void envmap_pixels(__global const EnvironmentRecord* record, REAL3 d, INT which[4], REAL weight[4]) {
  INT row, column;
  REAL down, across;
  envmap_cell(record, d, &row, &column, &down, &across);
  const int width = record->width;
  const INT next = SELECT_INT(column + 1 < width, column + 1, 0);
  UNROLL_FOR(int k = 0; k < 4; ++k) {
    which[k] = (row + (k >> 1)) * width + ((k & 1) ? next : column);
    weight[k] = ((k >> 1) ? down : 1 - down) * ((k & 1) ? across : 1 - across);
  }
}

static inline void envmap_derivative(__global const EnvironmentRecord* record, __global const EnvironmentRecord* moving,
                                     __global const float* tables, REAL3 d, REAL rgb[3]) {
  envmap_radiance(moving, tables, d, rgb);
}

/* sin^2(theta / 2) at the top of a row, and its increase across the row: proportional to solid angle, and with digits where
 * cos theta has none. */
static inline void envmap_row_bounds(__global const EnvironmentRecord* record, INT row, REAL* top, REAL* increase) {
  const float step = 1.0f / (record->height - 1);
  REAL sine, cosine;
  sin_cos_2pi(CAST_REAL(row) * (0.25f * step), &sine, &cosine);
  *top = sine * sine;
  sin_cos_2pi((CAST_REAL(row) + 0.5f) * (0.5f * step), &sine, &cosine);
  *increase = sine * sin((float)(0.5 * PI_) * step);
}

static inline REAL envmap_density(__global const EnvironmentRecord* record, REAL probability, REAL increase) {
  return probability * record->width / ((float)(4 * PI_) * increase);
}

static inline REAL envmap_pdf(__global const EnvironmentRecord* record, __global const float* tables, REAL3 d) {
  INT row, column;
  REAL down, across, top, increase;
  envmap_cell(record, d, &row, &column, &down, &across);
  envmap_row_bounds(record, row, &top, &increase);
  const REAL probability = cell_probability(tables, record->sampling, record->height - 1, record->width, row, column);
  return envmap_density(record, probability, increase);
}

static inline REAL3 envmap_sample(__global const EnvironmentRecord* record, __global const float* tables, REAL u0,
                                  REAL u1, REAL* pdf) {
  const int rows = record->height - 1, columns = record->width;
  REAL of_row, of_column, top, increase, sine, cosine;
  const INT row = pick_cell(tables, record->sampling, rows, &u0, &of_row);
  const INT column = pick_cell(tables, record->sampling + (rows + 1) + row * (columns + 1), columns, &u1, &of_column);
  envmap_row_bounds(record, row, &top, &increase);
  *pdf = envmap_density(record, of_row * of_column, increase);
  const REAL h = fmin(top + u0 * increase, (REAL)1);
  const REAL r = 2 * sqrt(h * (1 - h));
  REAL turn = (CAST_REAL(column) + u1 + 0.5f) / columns;
  turn = SELECT(turn >= 1, turn - 1, turn);
  sin_cos_2pi(turn, &sine, &cosine);
  return make3(r * sine, 1 - 2 * h, -r * cosine);
}
#endif

#endif
