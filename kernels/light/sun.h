/* The sun's disc, which is kept apart from the smooth rest of the light around a scene, since it needs a sampling of its own:
 * at surfaces, in media and through rough boundaries. Directions are in world space, unit, and point towards it.
 *
 * Compiled in on request: HAS_SUN, HAS_COMPLEX_SUN (limb darkening). A record without a sun has sun_pdf 0. */
#ifndef ITN_SUN_H
#define ITN_SUN_H
#include "shared/vector.h"
#include "model/angle.h"
#include "shared/environment_layout.h"

INLINE REAL3 environment_to_local(__global const EnvironmentRecord* record, REAL3 d) {
  __global const float* m = record->to_local;
  return make3(m[0] * d.x + m[1] * d.y + m[2] * d.z, m[3] * d.x + m[4] * d.y + m[5] * d.z,
               m[6] * d.x + m[7] * d.y + m[8] * d.z);
}

INLINE REAL3 environment_to_world(__global const EnvironmentRecord* record, REAL3 d) {
  __global const float* m = record->to_local;
  return make3(m[0] * d.x + m[3] * d.y + m[6] * d.z, m[1] * d.x + m[4] * d.y + m[7] * d.z,
               m[2] * d.x + m[5] * d.y + m[8] * d.z);
}

#ifndef HAS_SUN
#define HAS_SUN 0
#endif

#if HAS_SUN
/* Radiance inside the disc. z: cosine from the local zenith; chord2: squared distance of the unit vectors to the direction
 * and to the disc's centre. */
INLINE void sun_disc(__global const EnvironmentRecord* record, __global const float* tables, REAL z, REAL chord2,
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

/* Squared distance of two unit vectors, the direction and the one to the disc's centre: has digits where the cosine of a
 * small angle has none. */
INLINE REAL sun_chord2(__global const EnvironmentRecord* record, REAL3 direction) {
  __global const float* s = record->sun_direction;
  const REAL3 chord = make3(direction.x - s[0], direction.y - s[1], direction.z - s[2]);
  return dot3(chord, chord);
}

/* Is the direction inside the sun's disc? Never for a record without a sun: 1 <= 0. */
INLINE MASK in_sun(__global const EnvironmentRecord* record, REAL3 direction) {
  return sun_chord2(record, direction) <= record->sun_chord2;
}

/* The radiance of the sun's disc, 0 outside; gives in_sun. */
INLINE MASK sun_radiance(__global const EnvironmentRecord* record, __global const float* tables, REAL3 direction,
                         REAL rgb[3]) {
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = 0;
#if HAS_SUN
  if (record->sun_pdf > 0) {
    const REAL chord2 = sun_chord2(record, direction);
    const MASK inside = chord2 <= record->sun_chord2;
    if (ANY(inside)) {
      REAL disc[3];
      sun_disc(record, tables, environment_to_local(record, direction).z, chord2, disc);
      UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = SELECT(inside, disc[c], 0);
    }
    return inside;
  }
#endif
  return (INT)0;
}

/* A direction uniform in the sun's cone, with density record->sun_pdf. */
INLINE void sun_sample(__global const EnvironmentRecord* record, __global const float* tables, REAL u0, REAL u1,
                       REAL3* direction, REAL rgb[3]) {
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = 0;
  *direction = make3((REAL)0, (REAL)0, (REAL)1);
#if HAS_SUN
  if (record->sun_pdf > 0) {
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
    sun_disc(record, tables, environment_to_local(record, *direction).z, 2 * fall, rgb);
  }
#endif
}

#endif
