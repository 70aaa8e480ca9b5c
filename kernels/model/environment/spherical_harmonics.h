/* Light as a sum of real spherical harmonics.
 *
 *   L(d) = sum over l = 0 ... order and m = -l ... l of c_l_m Y_l_m(d)
 *   Y_l_m = N_l_|m| P_l_|m|(cos theta) times cos(m phi) sqrt 2 for m > 0, 1 for m = 0, sin(|m| phi) sqrt 2 for m < 0
 *
 * orthonormal on the sphere and without the phase (-1)^m of Condon and Shortley: Y_1_-1, Y_1_0, Y_1_1 = sqrt(3 / 4 pi) (y, z, x).
 * theta: from z; c_l_m [power / (area sr)], rgb, of either sign. Recurrences: Sloan 2013, "Efficient spherical harmonic
 * evaluation".
 * Tests: tests/kernel/environment_test.cpp */
#ifndef ITN_ENVIRONMENT_SPHERICAL_HARMONICS_H
#define ITN_ENVIRONMENT_SPHERICAL_HARMONICS_H
#include "shared/environment_layout.h"
#include "shared/portable.h"

/* The coefficient of order 0; those of higher orders have the same kind (include/itn/model.h). */
#define SPHERICAL_HARMONICS_PARAMETERS(PARAMETER) PARAMETER(c_0_0, COEFFICIENT, 0, "")
#define SPHERICAL_HARMONICS_TRAITS 0
#define SPHERICAL_HARMONICS_FORMULA ""
#define GREATEST_HARMONICS_ORDER 30

/* Cells of the sampling table: equal steps of z from 1 down, and of the angle about it from x on. */
#define HARMONICS_ROWS 64
#define HARMONICS_COLUMNS 128

#ifdef __OPENCL_VERSION__
#define HARMONICS_COEFFICIENTS __global const float*
#else
#define HARMONICS_COEFFICIENTS const float*
#endif

/* c: rgb of (l, m) at 3 (l^2 + l + m). */
MODEL_VOID spherical_harmonics_sum(HARMONICS_COEFFICIENTS c, int order, REAL3 d, REAL* rgb) {
  REAL cosine = NUMBER(1), sine = NUMBER(0); /* of m phi, times sin^m theta */
  float start = 0.28209479177f;              /* N_m_m P_m_m over sin^m theta */
  for (int k = 0; k < 3; ++k) rgb[k] = NUMBER(0);
  for (int m = 0; m <= order; ++m) {
    const float m2 = (float)(m * m);
    REAL before = NUMBER(0), p = NUMBER(1) * start;
    for (int l = m; l <= order; ++l) {
      const int plus = 3 * (l * l + l + m), minus = 3 * (l * l + l - m);
      const REAL even = p * cosine, odd = p * sine;
      for (int k = 0; k < 3; ++k)
        rgb[k] =
            m == 0 ? rgb[k] + even * c[plus + k] : rgb[k] + (even * c[plus + k] + odd * c[minus + k]) * 1.41421356f;
      const float l2 = (float)(l * l), next2 = (float)((l + 1) * (l + 1));
      const float grow = sqrt((4.0f * next2 - 1.0f) / (next2 - m2)), fall = sqrt((l2 - m2) / (4.0f * l2 - 1.0f));
      const REAL next = (d.z * p - before * (l == m ? 0.0f : fall)) * grow;
      before = p;
      p = next;
    }
    const REAL turned = d.x * cosine - d.y * sine;
    sine = d.x * sine + d.y * cosine;
    cosine = turned;
    start = start * sqrt((float)(2 * m + 3) / (float)(2 * m + 2));
  }
}

#ifdef __OPENCL_VERSION__
#include "model/angle.h"
#include "model/environment/sampling_table.h"

static inline void spherical_harmonics_radiance(__global const EnvironmentRecord* record, __global const float* tables,
                                                REAL3 d, REAL rgb[3]) {
  spherical_harmonics_sum(tables + record->values, record->width, d, rgb);
}

static inline void spherical_harmonics_derivative(__global const EnvironmentRecord* record,
                                                  __global const EnvironmentRecord* moving,
                                                  __global const float* tables, REAL3 d, REAL rgb[3]) {
  spherical_harmonics_radiance(moving, tables, d, rgb);
}

static inline REAL spherical_harmonics_density(REAL probability) {
  return probability * (float)(HARMONICS_ROWS * HARMONICS_COLUMNS / (4 * PI_));
}

static inline REAL spherical_harmonics_pdf(__global const EnvironmentRecord* record, __global const float* tables,
                                           REAL3 d) {
  REAL turn = angle_of(d.y, d.x) * (float)(0.5 / PI_);
  turn = SELECT(turn < 0, turn + 1, turn);
  const INT row = clamp(CAST_INT((1 - d.z) * (0.5f * HARMONICS_ROWS)), (INT)0, (INT)(HARMONICS_ROWS - 1));
  const INT column = clamp(CAST_INT(turn * HARMONICS_COLUMNS), (INT)0, (INT)(HARMONICS_COLUMNS - 1));
  return spherical_harmonics_density(
      cell_probability(tables, record->sampling, HARMONICS_ROWS, HARMONICS_COLUMNS, row, column));
}

static inline REAL3 spherical_harmonics_sample(__global const EnvironmentRecord* record, __global const float* tables,
                                               REAL u0, REAL u1, REAL* pdf) {
  REAL of_row, of_column, sine, cosine;
  const INT row = pick_cell(tables, record->sampling, HARMONICS_ROWS, &u0, &of_row);
  const INT column = pick_cell(tables, record->sampling + (HARMONICS_ROWS + 1) + row * (HARMONICS_COLUMNS + 1),
                               HARMONICS_COLUMNS, &u1, &of_column);
  *pdf = spherical_harmonics_density(of_row * of_column);
  const REAL h = (CAST_REAL(row) + u0) * (1.0f / HARMONICS_ROWS); /* sin^2(theta / 2) */
  const REAL r = 2 * sqrt(h * (1 - h));
  sin_cos_2pi((CAST_REAL(column) + u1) * (1.0f / HARMONICS_COLUMNS), &sine, &cosine);
  return make3(r * cosine, r * sine, 1 - 2 * h);
}
#endif

#endif
