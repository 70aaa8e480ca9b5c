/* The clear sky of Hosek and Wilkie (2012); its sun is in sun.h. z is up.
 *
 * turbidity in [1, 10]; albedo of the ground in [0, 1]; sun_scale and sky_scale multiply the radiance of each. Agrees with
 * Mitsuba 3's "sunsky".
 * Tests: tests/kernel/environment_test.cpp, tests/derivative/emission_test.cpp */
#ifndef ITN_ENVIRONMENT_SUNSKY_H
#define ITN_ENVIRONMENT_SUNSKY_H
#include "shared/environment_layout.h"

#define SUNSKY_PARAMETERS(PARAMETER)        \
  PARAMETER(turbidity, TURBIDITY, 3, "")    \
  PARAMETER(albedo, GROUND_ALBEDO, 0.3, "") \
  PARAMETER(sun_scale, NON_NEGATIVE, 1, "") \
  PARAMETER(sky_scale, NON_NEGATIVE, 1, "")
#define SUNSKY_TRAITS 0
#define SUNSKY_FORMULA "derivative_sky_hosek_wilkie"

#ifdef __OPENCL_VERSION__
#include "model/angle.h"
#include "model/environment/sampling_table.h"
#include "model/sky_hosek_wilkie.h"

/* The angles of a direction that the sky's model takes: from the zenith, and from the sun. */
typedef struct {
  REAL cos_theta, gamma, one_minus_cos;
} SkyAngles;

static inline SkyAngles sky_angles(__global const EnvironmentRecord* record, REAL3 d) {
  __global const float* s = record->sun_local;
  const REAL3 sun = make3((REAL)s[0], (REAL)s[1], (REAL)s[2]);
  const REAL3 chord = sub3(d, sun);
  SkyAngles angles;
  angles.cos_theta = fmax(d.z, (REAL)0);
  angles.gamma = angle_between(d, sun);
  angles.one_minus_cos = 0.5f * dot3(chord, chord);
  return angles;
}

static inline void sunsky_radiance(__global const EnvironmentRecord* record, __global const float* tables, REAL3 d,
                                   REAL rgb[3]) {
  const SkyAngles angles = sky_angles(record, d);
  UNROLL_FOR(int c = 0; c < 3; ++c) {
    REAL k[SKY_COEFFICIENTS];
    UNROLL_FOR(int i = 0; i < SKY_COEFFICIENTS; ++i) k[i] = record->sky[c * SKY_COEFFICIENTS + i];
    const REAL radiance = sky_hosek_wilkie(k, angles.cos_theta, angles.gamma, angles.one_minus_cos);
    rgb[c] = SELECT(d.z < 0, 0, radiance);
  }
}

#if HAS_LIGHT_DERIVATIVES
/* Printed from model/sky_hosek_wilkie.h to program/scores.h. */
static inline void derivative_sky_hosek_wilkie(const REAL* k, const REAL* d_k, REAL cos_theta, REAL gamma,
                                               REAL one_minus_cos, REAL* d_radiance);

static inline void sunsky_derivative(__global const EnvironmentRecord* record, __global const EnvironmentRecord* moving,
                                     __global const float* tables, REAL3 d, REAL rgb[3]) {
  const SkyAngles angles = sky_angles(record, d);
  UNROLL_FOR(int c = 0; c < 3; ++c) {
    REAL k[SKY_COEFFICIENTS], d_k[SKY_COEFFICIENTS], d_radiance;
    UNROLL_FOR(int i = 0; i < SKY_COEFFICIENTS; ++i) {
      k[i] = record->sky[c * SKY_COEFFICIENTS + i];
      d_k[i] = moving->sky[c * SKY_COEFFICIENTS + i];
    }
    derivative_sky_hosek_wilkie(k, d_k, angles.cos_theta, angles.gamma, angles.one_minus_cos, &d_radiance);
    rgb[c] = SELECT(d.z < 0, 0, d_radiance);
  }
}
#endif

/* Solid angle of a cell: its rows are bounded by cos theta = (row / SKY_ROWS)^2. */
static inline REAL sunsky_density(REAL probability, INT row) {
  return probability * (float)(SKY_ROWS * SKY_ROWS * SKY_COLUMNS / (2 * PI_)) / CAST_REAL(2 * row + 1);
}

static inline REAL sunsky_pdf(__global const EnvironmentRecord* record, __global const float* tables, REAL3 d) {
  const float ca = record->sun_azimuth_cos, sa = record->sun_azimuth_sin;
  REAL turn = angle_of(d.y * ca - d.x * sa, d.x * ca + d.y * sa) * (float)(0.5 / PI_);
  turn = SELECT(turn < 0, turn + 1, turn);
  /* clamped below too: idle lanes may hold any direction */
  const INT row = clamp(CAST_INT(sqrt(fmax(d.z, (REAL)0)) * SKY_ROWS), (INT)0, (INT)(SKY_ROWS - 1));
  const INT column = clamp(CAST_INT(turn * SKY_COLUMNS), (INT)0, (INT)(SKY_COLUMNS - 1));
  const REAL probability = cell_probability(tables, record->sampling, SKY_ROWS, SKY_COLUMNS, row, column);
  return SELECT(d.z < 0, 0, sunsky_density(probability, row));
}

static inline REAL3 sunsky_sample(__global const EnvironmentRecord* record, __global const float* tables, REAL u0,
                                  REAL u1, REAL* pdf) {
  REAL of_row, of_column, sine, cosine;
  const INT row = pick_cell(tables, record->sampling, SKY_ROWS, &u0, &of_row);
  const INT column =
      pick_cell(tables, record->sampling + (SKY_ROWS + 1) + row * (SKY_COLUMNS + 1), SKY_COLUMNS, &u1, &of_column);
  *pdf = sunsky_density(of_row * of_column, row);
  const REAL z = (CAST_REAL(row * row) + CAST_REAL(2 * row + 1) * u0) * (1.0f / (SKY_ROWS * SKY_ROWS));
  const REAL r = sqrt((1 - z) * (1 + z));
  sin_cos_2pi((CAST_REAL(column) + u1) * (1.0f / SKY_COLUMNS), &sine, &cosine);
  const float ca = record->sun_azimuth_cos, sa = record->sun_azimuth_sin;
  return make3(r * (cosine * ca - sine * sa), r * (cosine * sa + sine * ca), z);
}
#endif

#endif
