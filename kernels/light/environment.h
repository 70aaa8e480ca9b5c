/* The light that surrounds a scene: radiance from a direction, and directions drawn in proportion to it, WIDTH lanes at a
 * time: model/environment/list.h expanded for those that the scene has (ENVIRONMENTS_OF_SCENE of the program,
 * runtime/render/compile/surfaces.h), and the sun (light/sun.h) beside what is smooth. Directions are in world space, unit, and point
 * away from the scene (towards the light). Radiance is linear sRGB and not clamped: some channels of the sun-sky model are
 * negative.
 *
 * Jobs with different light share a launch; a record may only be of a model that the program has.
 * Tests: tests/kernel/environment_test.cpp */
#ifndef ITN_ENVIRONMENT_H
#define ITN_ENVIRONMENT_H
#include "light/sun.h"
#include "model/models.h"
#include "program/surfaces.h"

/* The smooth part. */
#define RADIANCE_OF_ENVIRONMENT(name, PREFIX) \
  case MODEL_##name: name##_radiance(record, tables, d, rgb); return;
INLINE void smooth_radiance(__global const EnvironmentRecord* record, __global const float* tables, REAL3 direction,
                            REAL rgb[3]) {
  const REAL3 d = environment_to_local(record, direction);
  switch (record->model) { ENVIRONMENTS_OF_SCENE(RADIANCE_OF_ENVIRONMENT) }
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = 0;
}

/* All of it. */
INLINE void environment_radiance(__global const EnvironmentRecord* record, __global const float* tables,
                                 REAL3 direction, REAL rgb[3]) {
  smooth_radiance(record, tables, direction, rgb);
#if HAS_SUN
  REAL sun[3];
  const MASK inside = sun_radiance(record, tables, direction, sun);
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] += SELECT(inside, sun[c], 0.0f);
#endif
}

#if HAS_LIGHT_DERIVATIVES
/* Its derivative by the parameter of `moving` (environment_derivative in runtime/render/compile/environment.h). The
 * sun is linear in its radiance. */
#define DERIVATIVE_OF_ENVIRONMENT(name, PREFIX) \
  case MODEL_##name: name##_derivative(record, moving, tables, d, rgb); break;
INLINE void environment_derivative(__global const EnvironmentRecord* record, __global const EnvironmentRecord* moving,
                                   __global const float* tables, REAL3 direction, REAL rgb[3]) {
  const REAL3 d = environment_to_local(record, direction);
  switch (record->model) { ENVIRONMENTS_OF_SCENE(DERIVATIVE_OF_ENVIRONMENT) }
#if HAS_SUN
  REAL sun[3];
  sun_radiance(moving, tables, direction, sun);
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] += sun[c];
#endif
}
#endif

/* Density of smooth_sample [1/sr]. */
#define PDF_OF_ENVIRONMENT(name, PREFIX) \
  case MODEL_##name: return name##_pdf(record, tables, d);
INLINE REAL smooth_pdf(__global const EnvironmentRecord* record, __global const float* tables, REAL3 direction) {
  const REAL3 d = environment_to_local(record, direction);
  switch (record->model) { ENVIRONMENTS_OF_SCENE(PDF_OF_ENVIRONMENT) }
  return (REAL)(0);
}

/* A direction drawn in proportion to the smooth part; where *pdf is 0 there is none. */
#define SAMPLE_OF_ENVIRONMENT(name, PREFIX) \
  case MODEL_##name: d = name##_sample(record, tables, u0, u1, pdf); break;
INLINE REAL3 smooth_sample(__global const EnvironmentRecord* record, __global const float* tables, REAL u0, REAL u1,
                           REAL* pdf) {
  REAL3 d = make3((REAL)(0), (REAL)(0), (REAL)(1));
  *pdf = (REAL)(0);
  switch (record->model) { ENVIRONMENTS_OF_SCENE(SAMPLE_OF_ENVIRONMENT) }
  return environment_to_world(record, d);
}

#endif
