/* The light that surrounds a scene: radiance from a direction, and directions drawn in proportion to it, WIDTH lanes at a
 * time. Directions are in world space, unit, and point away from the scene (towards the light).
 *
 * The sun's disc is kept apart from the smooth rest ("sky": constant light, environment map, sky), since each needs its own
 * sampling. Radiance is linear sRGB and not clamped: some channels of the sun-sky model are negative.
 *
 * Compiled in on request: HAS_ENVMAP, HAS_SUN (sun and sky), HAS_COMPLEX_SUN (limb darkening). A record may only be of a kind
 * that is compiled in; see emitter_definitions in runtime/compile/emitter.h.
 * Tests: tests/kernel/emitter_test.cpp */
#ifndef ITN_EMITTER_H
#define ITN_EMITTER_H
#include "lib/vector.h"
#include "model/angle.h"
#include "model/sky_hosek_wilkie.h"
#include "shared/emitter_layout.h"

inline REAL3 uniform_sphere(REAL u0, REAL u1) {
  REAL sine, cosine;
  sin_cos_2pi(u1, &sine, &cosine);
  const REAL r = 2 * sqrt(u0 * (1 - u0));
  return make3(r * cosine, r * sine, 1 - 2 * u0);
}

#if HAS_ENVMAP || HAS_SUN

inline REAL3 emitter_to_local(__global const EmitterRecord* record, REAL3 d) {
  __global const float* m = record->to_local;
  return make3(m[0] * d.x + m[1] * d.y + m[2] * d.z, m[3] * d.x + m[4] * d.y + m[5] * d.z,
               m[6] * d.x + m[7] * d.y + m[8] * d.z);
}

inline REAL3 emitter_to_world(__global const EmitterRecord* record, REAL3 d) {
  __global const float* m = record->to_local;
  return make3(m[0] * d.x + m[3] * d.y + m[6] * d.z, m[1] * d.x + m[4] * d.y + m[7] * d.z,
               m[2] * d.x + m[5] * d.y + m[8] * d.z);
}

/* Sampling tables: cdf[0] = 0 <= ... <= cdf[n] = 1, multiples of 2^-24 like the random numbers, so that the probability of
 * a cell is the difference of its bounds exactly. Rows come first, then each row's columns. */

/* The cell of u; u becomes its place in the cell, [0, 1). */
inline INT pick_cell(__global const float* tables, INT cdf, int n, REAL* u, REAL* probability) {
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

inline REAL cell_probability(__global const float* tables, int rows_cdf, int rows, int columns, INT row, INT column) {
  const INT at = rows_cdf + row;
  const INT along = rows_cdf + (rows + 1) + row * (columns + 1) + column;
  return (GATHER(tables, at + 1) - GATHER(tables, at)) * (GATHER(tables, along + 1) - GATHER(tables, along));
}

#endif

#if HAS_ENVMAP
/* Mitsuba 3's convention: y is up, +z is the middle of the picture, -x to the right of it; the first and the last row are the
 * poles themselves, so there are height - 1 steps of polar angle; columns are `width` steps of azimuth about their centres;
 * between pixels the radiance is bilinear in these angles. A cell of the sampling table lies between four pixels. */
inline void envmap_cell(__global const EmitterRecord* record, REAL3 direction, INT* row, INT* column, REAL* down,
                        REAL* across) {
  const REAL3 d = emitter_to_local(record, direction);
  const int width = record->width, height = record->height;
  REAL x = angle_of(d.x, -d.z) * (float)(0.5 / PI_) - 0.5f / width;
  x = (x - floor(x)) * width;
  const REAL y = angle_of(sqrt(d.x * d.x + d.z * d.z), d.y) * (float)(1 / PI_) * (height - 1);
  *column = clamp(CAST_INT(x), (INT)0, (INT)(width - 1)); /* idle lanes may hold any direction */
  *row = clamp(CAST_INT(y), (INT)0, (INT)(height - 2));
  *across = x - CAST_REAL(*column);
  *down = y - CAST_REAL(*row);
}

inline void envmap_radiance(__global const EmitterRecord* record, __global const float* tables, REAL3 direction,
                            REAL rgb[3]) {
  INT row, column;
  REAL down, across;
  envmap_cell(record, direction, &row, &column, &down, &across);
  const int stride = 3 * (record->width + 1);
  const INT at = record->pixels + row * stride + column * 3;
  UNROLL_FOR(int c = 0; c < 3; ++c) {
    const REAL a = GATHER(tables, at + c), b = GATHER(tables, at + (c + 3));
    const REAL e = GATHER(tables, at + (c + stride)), f = GATHER(tables, at + (c + stride + 3));
    rgb[c] =
        record->radiance[c] * ((1 - down) * ((1 - across) * a + across * b) + down * ((1 - across) * e + across * f));
  }
}

/* sin^2(theta / 2) at the top of a row, and its increase across the row: proportional to solid angle, and with digits where
 * cos theta has none. */
inline void envmap_row_bounds(__global const EmitterRecord* record, INT row, REAL* top, REAL* increase) {
  const float step = 1.0f / (record->height - 1);
  REAL sine, cosine;
  sin_cos_2pi(CAST_REAL(row) * (0.25f * step), &sine, &cosine);
  *top = sine * sine;
  sin_cos_2pi((CAST_REAL(row) + 0.5f) * (0.5f * step), &sine, &cosine);
  *increase = sine * sin((float)(0.5 * PI_) * step);
}

inline REAL envmap_density(__global const EmitterRecord* record, REAL probability, REAL increase) {
  return probability * record->width / ((float)(4 * PI_) * increase);
}

inline REAL envmap_pdf(__global const EmitterRecord* record, __global const float* tables, REAL3 direction) {
  INT row, column;
  REAL down, across, top, increase;
  envmap_cell(record, direction, &row, &column, &down, &across);
  envmap_row_bounds(record, row, &top, &increase);
  const REAL probability = cell_probability(tables, record->sampling, record->height - 1, record->width, row, column);
  return envmap_density(record, probability, increase);
}

inline REAL3 envmap_sample(__global const EmitterRecord* record, __global const float* tables, REAL u0, REAL u1,
                           REAL* pdf) {
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
  return emitter_to_world(record, make3(r * sine, 1 - 2 * h, -r * cosine));
}
#endif

#if HAS_SUN
/* What the sky's model takes of a direction: from the zenith, and from the sun. */
typedef struct {
  REAL cos_theta, gamma, one_minus_cos;
} SkyAngles;

/* d: in the local frame */
inline SkyAngles sky_angles(__global const EmitterRecord* record, REAL3 d) {
  __global const float* s = record->sun_local;
  const REAL3 sun = make3((REAL)s[0], (REAL)s[1], (REAL)s[2]);
  const REAL3 chord = sub3(d, sun);
  SkyAngles angles;
  angles.cos_theta = fmax(d.z, (REAL)0);
  angles.gamma = angle_between(d, sun);
  angles.one_minus_cos = 0.5f * dot3(chord, chord);
  return angles;
}

/* d: in the local frame */
inline void clear_sky_radiance(__global const EmitterRecord* record, REAL3 d, REAL rgb[3]) {
  const SkyAngles angles = sky_angles(record, d);
  UNROLL_FOR(int c = 0; c < 3; ++c) {
    REAL k[SKY_COEFFICIENTS];
    UNROLL_FOR(int i = 0; i < SKY_COEFFICIENTS; ++i) k[i] = record->sky[c * SKY_COEFFICIENTS + i];
    const REAL radiance = sky_hosek_wilkie(k, angles.cos_theta, angles.gamma, angles.one_minus_cos);
    rgb[c] = SELECT(d.z < 0, 0, radiance);
  }
}

/* Solid angle of a cell: its rows are bounded by cos theta = (row / SKY_ROWS)^2. */
inline REAL clear_sky_density(REAL probability, INT row) {
  return probability * (float)(SKY_ROWS * SKY_ROWS * SKY_COLUMNS / (2 * PI_)) / CAST_REAL(2 * row + 1);
}

inline REAL clear_sky_pdf(__global const EmitterRecord* record, __global const float* tables, REAL3 direction) {
  const REAL3 d = emitter_to_local(record, direction);
  const float ca = record->sun_azimuth_cos, sa = record->sun_azimuth_sin;
  REAL turn = angle_of(d.y * ca - d.x * sa, d.x * ca + d.y * sa) * (float)(0.5 / PI_);
  turn = SELECT(turn < 0, turn + 1, turn);
  /* clamped below too: idle lanes may hold any direction */
  const INT row = clamp(CAST_INT(sqrt(fmax(d.z, (REAL)0)) * SKY_ROWS), (INT)0, (INT)(SKY_ROWS - 1));
  const INT column = clamp(CAST_INT(turn * SKY_COLUMNS), (INT)0, (INT)(SKY_COLUMNS - 1));
  const REAL probability = cell_probability(tables, record->sampling, SKY_ROWS, SKY_COLUMNS, row, column);
  return SELECT(d.z < 0, 0, clear_sky_density(probability, row));
}

inline REAL3 clear_sky_sample(__global const EmitterRecord* record, __global const float* tables, REAL u0, REAL u1,
                              REAL* pdf) {
  REAL of_row, of_column, sine, cosine;
  const INT row = pick_cell(tables, record->sampling, SKY_ROWS, &u0, &of_row);
  const INT column =
      pick_cell(tables, record->sampling + (SKY_ROWS + 1) + row * (SKY_COLUMNS + 1), SKY_COLUMNS, &u1, &of_column);
  *pdf = clear_sky_density(of_row * of_column, row);
  const REAL z = (CAST_REAL(row * row) + CAST_REAL(2 * row + 1) * u0) * (1.0f / (SKY_ROWS * SKY_ROWS));
  const REAL r = sqrt((1 - z) * (1 + z));
  sin_cos_2pi((CAST_REAL(column) + u1) * (1.0f / SKY_COLUMNS), &sine, &cosine);
  const float ca = record->sun_azimuth_cos, sa = record->sun_azimuth_sin;
  return emitter_to_world(record, make3(r * (cosine * ca - sine * sa), r * (cosine * sa + sine * ca), z));
}

/* Radiance inside the disc. z: cosine from the local zenith; chord2: squared distance of the unit vectors to the direction
 * and to the disc's centre. */
inline void sun_disc(__global const EmitterRecord* record, __global const float* tables, REAL z, REAL chord2,
                     REAL rgb[3]) {
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = SELECT(z < 0, 0, record->sun_radiance[c]);
#if HAS_COMPLEX_SUN
  if (!record->complex_sun) return;
  const float omc = record->sun_one_minus_cos;
  const REAL sin2 = chord2 * (1 - 0.25f * chord2);
  const REAL mu = sqrt(fmax((REAL)0, 1 - sin2 / (omc * (2 - omc))));
  const REAL up = fmax(z, (REAL)0);
  const REAL elevation = angle_of(up, sqrt(fmax((REAL)0, (1 - up) * (1 + up))));
  /* knots at elevations (pi/2) (i / 45)^3; rounding to the wrong side of one is harmless, the curve is smooth there */
  const REAL share = elevation * (float)(2 / PI_);
  const INT knot =
      clamp(CAST_INT(exp(log(fmax(share, (REAL)1e-20f)) * (1.0f / 3)) * (SUN_KNOTS - 1)), (INT)0, (INT)(SUN_KNOTS - 2));
  const REAL i = CAST_REAL(knot);
  const float cube = 1.0f / ((SUN_KNOTS - 1) * (SUN_KNOTS - 1) * (SUN_KNOTS - 1));
  const REAL steps = 3 * i * (i + 1) + 1; /* (i + 1)^3 - i^3 */
  const REAL width = steps * (cube * (float)(PI_ / 2));
  const REAL t = (share / cube - i * i * i) / steps;
  const REAL from = (1 + 2 * t) * (1 - t) * (1 - t), to = t * t * (3 - 2 * t);
  const REAL slope_from = width * t * (1 - t) * (1 - t), slope_to = -width * t * t * (1 - t);
  const int stride = 3 * SUN_POWERS * 2;
  UNROLL_FOR(int c = 0; c < 3; ++c) {
    REAL sum = 0;
    UNROLL_FOR(int power = SUN_POWERS - 1; power >= 0; --power) {
      const INT at = record->sun_table + knot * stride + (c * SUN_POWERS + power) * 2;
      sum = sum * mu + (from * GATHER(tables, at) + slope_from * GATHER(tables, at + 1) +
                        to * GATHER(tables, at + stride) + slope_to * GATHER(tables, at + (stride + 1)));
    }
    rgb[c] = SELECT(z < 0, 0, sum);
  }
#endif
}
#endif

/* The smooth part. */
inline void emitter_sky_radiance(__global const EmitterRecord* record, __global const float* tables, REAL3 direction,
                                 REAL rgb[3]) {
#if HAS_ENVMAP
  if (record->kind == EMITTER_ENVMAP) {
    envmap_radiance(record, tables, direction, rgb);
    return;
  }
#endif
#if HAS_SUN
  if (record->kind == EMITTER_SUNSKY) {
    clear_sky_radiance(record, emitter_to_local(record, direction), rgb);
    return;
  }
#endif
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = record->radiance[c];
}

/* Squared distance of two unit vectors, the direction and the one to the disc's centre: has digits where the cosine of a
 * small angle has none. */
inline REAL sun_chord2(__global const EmitterRecord* record, REAL3 direction) {
  __global const float* s = record->sun_direction;
  const REAL3 chord = make3(direction.x - s[0], direction.y - s[1], direction.z - s[2]);
  return dot3(chord, chord);
}

/* Is the direction inside the sun's disc? Never for a record without a sun: 1 <= 0. */
inline MASK emitter_in_sun(__global const EmitterRecord* record, REAL3 direction) {
  return sun_chord2(record, direction) <= record->sun_chord2;
}

/* The radiance of the sun's disc, 0 outside; gives emitter_in_sun. */
inline MASK emitter_sun_radiance(__global const EmitterRecord* record, __global const float* tables, REAL3 direction,
                                 REAL rgb[3]) {
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = 0;
#if HAS_SUN
  if (record->kind == EMITTER_SUNSKY) {
    const REAL chord2 = sun_chord2(record, direction);
    const MASK inside = chord2 <= record->sun_chord2;
    if (ANY(inside)) {
      REAL disc[3];
      sun_disc(record, tables, emitter_to_local(record, direction).z, chord2, disc);
      UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = SELECT(inside, disc[c], 0);
    }
    return inside;
  }
#endif
  return (INT)0;
}

/* A direction uniform in the sun's cone, with density record->sun_pdf. */
inline void sun_sample(__global const EmitterRecord* record, __global const float* tables, REAL u0, REAL u1,
                       REAL3* direction, REAL rgb[3]) {
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = 0;
  *direction = make3((REAL)0, (REAL)0, (REAL)1);
#if HAS_SUN
  if (record->kind == EMITTER_SUNSKY) {
    const REAL fall = u0 * record->sun_one_minus_cos; /* 1 - cosine from the disc's centre */
    const REAL r = sqrt(fall * (2 - fall));
    REAL sine, cosine;
    sin_cos_2pi(u1, &sine, &cosine);
    __global const float* s = record->sun_direction;
    __global const float* a = record->sun_tangent;
    __global const float* b = record->sun_bitangent;
    const REAL along = 1 - fall, ra = r * cosine, rb = r * sine;
    *direction = make3(along * s[0] + ra * a[0] + rb * b[0], along * s[1] + ra * a[1] + rb * b[1],
                       along * s[2] + ra * a[2] + rb * b[2]);
    sun_disc(record, tables, emitter_to_local(record, *direction).z, 2 * fall, rgb);
  }
#endif
}

/* Density of sky_sample [1/sr]. */
inline REAL sky_pdf(__global const EmitterRecord* record, __global const float* tables, REAL3 direction) {
#if HAS_ENVMAP
  if (record->kind == EMITTER_ENVMAP) return envmap_pdf(record, tables, direction);
#endif
#if HAS_SUN
  if (record->kind == EMITTER_SUNSKY) return clear_sky_pdf(record, tables, direction);
#endif
  return record->kind == EMITTER_CONSTANT ? (REAL)(float)(1 / (4 * PI_)) : (REAL)0;
}

/* A direction drawn in proportion to the smooth part; where *pdf is 0 there is none. */
inline void sky_sample(__global const EmitterRecord* record, __global const float* tables, REAL u0, REAL u1,
                       REAL3* direction, REAL* pdf, REAL rgb[3]) {
#if HAS_ENVMAP
  if (record->kind == EMITTER_ENVMAP)
    *direction = envmap_sample(record, tables, u0, u1, pdf);
  else
#endif
#if HAS_SUN
      if (record->kind == EMITTER_SUNSKY)
    *direction = clear_sky_sample(record, tables, u0, u1, pdf);
  else
#endif
  {
    *direction = uniform_sphere(u0, u1);
    *pdf = record->kind == EMITTER_CONSTANT ? (REAL)(float)(1 / (4 * PI_)) : (REAL)0;
  }
  emitter_sky_radiance(record, tables, *direction, rgb);
}

#endif
