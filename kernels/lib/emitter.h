/* The light that surrounds a scene: radiance from a direction, and directions drawn in proportion to it, WIDTH lanes at a
 * time. Directions are in world space, unit, and point away from the scene (towards the light).
 *
 * The sun's disc is kept apart from the smooth rest ("sky": constant light, environment map, sky), since each needs its own
 * sampling. Radiance is linear sRGB and not clamped: some channels of the sun-sky model are negative.
 *
 * Compiled in on request: HAS_ENVMAP, HAS_SUN (sun and sky), HAS_COMPLEX_SUN (limb darkening). A record may only be of a kind
 * that is compiled in; see emitter_definitions in runtime/scene/emitter.h. */
#ifndef ITN_EMITTER_H
#define ITN_EMITTER_H
#include "lib/vector.h"
#include "shared/emitter_layout.h"

inline REAL3 uniform_sphere(REAL u0, REAL u1) {
  REAL sine, cosine;
  sin_cos_2pi(u1, &sine, &cosine);
  const REAL z = 1 - 2 * u0;
  const REAL r = 2 * sqrt(u0 * (1 - u0));
  return make3(r * cosine, r * sine, z);
}

/* The smooth part. */
inline void emitter_sky_radiance(__global const EmitterRecord* record, __global const float* tables, REAL3 direction,
                                 REAL rgb[3]) {
  for (int c = 0; c < 3; ++c) rgb[c] = record->radiance[c];
}

/* The sun's disc: is the direction inside? rgb is 0 outside. */
inline MASK emitter_sun_radiance(__global const EmitterRecord* record, __global const float* tables, REAL3 direction,
                                 REAL rgb[3]) {
  for (int c = 0; c < 3; ++c) rgb[c] = 0;
  return (INT)0;
}

/* A direction uniform in the sun's cone, with density record->sun_pdf. */
inline void sun_sample(__global const EmitterRecord* record, __global const float* tables, REAL u0, REAL u1,
                       REAL3* direction, REAL rgb[3]) {
  for (int c = 0; c < 3; ++c) rgb[c] = 0;
  *direction = make3((REAL)0, (REAL)0, (REAL)1);
}

/* Density of sky_sample [1/sr]. */
inline REAL sky_pdf(__global const EmitterRecord* record, __global const float* tables, REAL3 direction) {
  return record->kind == EMITTER_CONSTANT ? (REAL)(float)(1 / (4 * PI_)) : (REAL)0;
}

/* A direction drawn in proportion to the smooth part; where *pdf is 0 there is none. */
inline void sky_sample(__global const EmitterRecord* record, __global const float* tables, REAL u0, REAL u1,
                       REAL3* direction, REAL* pdf, REAL rgb[3]) {
  *direction = uniform_sphere(u0, u1);
  *pdf = sky_pdf(record, tables, *direction);
  emitter_sky_radiance(record, tables, *direction, rgb);
}

#endif
