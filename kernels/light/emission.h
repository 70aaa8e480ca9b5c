/* Derivatives of the image by parameters of the light. Radiance enters a path's contribution as a factor of its own, so
 * that these need no score: what multiplies the radiance there multiplies its derivative. Light that is linear in its
 * record has the derivative that the same code gives for a record of derivatives ("moving", made by environment_derivative in
 * runtime/render/compile/environment.h); that of the sky is printed from its model. Lights of the scene are linear in their colours.
 * Tests: tests/derivative/emission_test.cpp, tests/transport/emission_test.cpp */
#ifndef ITN_EMISSION_H
#define ITN_EMISSION_H
#include "light/environment.h"
#include "light/sun.h"
#include "derivative/adjoint.h"
#include "path/launch.h"
#include "light/light.h"
#include "program/scores.h"

#if LIGHT_TEXELS
/* To the texels of pictures that tint lights, and to the sums of these numbers. x: adjoint times what a texel's change
 * is multiplied by; first: of each lane's light, -1: it has no picture. */
INLINE void add_to_pictures(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, MASK mask,
                            INT first, const REAL uv[2], const REAL x[RADIANCE_CHANNELS]) {
  Lanes number, set, u, v;
  LongLanes sum[RADIANCE_CHANNELS];
  MASK beyond = (MASK)(0);
  number.integer = first + LIGHT_TINT_SLOT;
  set.integer = gradient_set(job, pool, slots) * SUMS_OF_A_SET;
  u.real = uv[0];
  v.real = uv[1];
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) sum[c].integer = rounded(x[c], &beyond);
  FOR_EACH_LANE(l, lane_bits(mask & (first >= 0))) {
    long own[TEXEL_CHANNELS] = {0};
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
      own[c] = sum[c].i[l];
      const int at = number.i[l] + (THROUGHPUT_CHANNELS == 1 ? 0 : c);
      add_to_gradient(launch, set.i[l] + at * RADIANCE_CHANNELS + c, own[c]);
    }
    if (!job->contrast) add_to_texels(launch, number.i[l], (TexturePlace){u.f[l], v.f[l]}, own);
  }
  add_lost(launch, mask & (first >= 0) & beyond);
}

/* weight, source: as of gather_light_derivatives. */
INLINE void gather_light_texels(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                                MASK mask, const REAL weight[RADIANCE_CHANNELS], const LightSource* source) {
  const INT light = max(source->index, 0);
  const INT model = GATHER_INT(LIGHT_MEMBER_INT(launch, model), light * LIGHT_WORDS);
  const INT numbers = GATHER_INT(LIGHT_MEMBER_INT(launch, first_number), light * LIGHT_WORDS);
  INT first = (INT)(-1);
#define FIND_PICTURE(name, PREFIX) \
  if (PREFIX##_TRAITS & LIGHT_TINTED) first = SELECT_INT(model == MODEL_##name, numbers, first);
  LIGHTS_OF_SCENE(FIND_PICTURE)
  REAL rgb[3], x[RADIANCE_CHANNELS];
  light_colour(launch, light, rgb);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
    x[c] = LOAD(pool, PIXEL_ADJOINT + c, slots) * weight[c] * rgb[c] * source->plain;
  add_to_pictures(launch, job, pool, slots, mask & (source->index >= 0), first, source->uv, x);
}
#endif

#if ENVIRONMENT_TEXELS
/* To the pixels of the picture around the scene. weight: as of gather_light_derivatives; direction: towards the light. */
INLINE void gather_environment_texels(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                                      MASK mask, const REAL weight[RADIANCE_CHANNELS], REAL3 direction) {
  __global const EnvironmentRecord* record = launch->environments + job->environment;
  if (record->gradient < 0 || job->contrast) return;
  INT which[4];
  REAL share[4];
  envmap_pixels(record, environment_to_local(record, direction), which, share);
  const uint bits = lane_bits(mask);
  MASK beyond = (MASK)(0);
  UNROLL_FOR(int k = 0; k < 4; ++k) {
    Lanes texel;
    texel.integer = record->gradient + which[k];
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
      LongLanes sum;
      sum.integer = rounded(LOAD(pool, PIXEL_ADJOINT + c, slots) * weight[c] * record->radiance[c] * share[k], &beyond);
      FOR_EACH_LANE(l, bits) add_to_texel(launch, texel.i[l], c, sum.i[l]);
    }
  }
  add_lost(launch, mask & beyond);
}
#endif

/* Adds to the derivatives by the light what reaches the lanes in `mask` from where it comes. weight: what the radiance of the
 * light is multiplied by on its way to the pixel. */
INLINE void gather_light_derivatives(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots,
                                     MASK mask, const REAL weight[RADIANCE_CHANNELS], const LightSource* source) {
#if LIGHT_TEXELS
  if (job->replay == REPLAY_SUMS) gather_light_texels(launch, job, pool, slots, mask, weight, source);
#endif
#if ENVIRONMENT_TEXELS
  if (job->replay == REPLAY_SUMS)
    gather_environment_texels(launch, job, pool, slots, mask & (source->index < 0), weight, source->direction);
#endif
#if HAS_LIGHT_DERIVATIVES
#if ADJOINT
  if (job->replay != REPLAY_SUMS) return;
#endif
#if HAS_LIGHTS
  INT numbers = GATHER_INT(LIGHT_MEMBER_INT(launch, first_number), max(source->index, 0) * LIGHT_WORDS);
  numbers = SELECT_INT(source->index < 0, -1, numbers);
#endif
  for (int p = 0; p < PARTS + LIGHT_NUMBERS; ++p) { /* not unrolled: one copy of the light's code is long enough */
    const int moving = launch->derivatives[p].environment, light = launch->derivatives[p].light;
    if (moving < 0 && light < 0) continue;
    REAL rgb[3];
    if (moving >= 0)
      environment_derivative(launch->environments + job->environment, launch->environments + moving,
                             launch->light_tables, source->direction, rgb);
    else
      UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = source->share[c] * launch->derivatives[p].colour[c];
#if HAS_LIGHTS
    UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = SELECT(numbers == light, rgb[c], 0.0f);
#endif
#if ADJOINT
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) rgb[c] *= weight[c] * launch->derivatives[p].factor[c];
    add_light_adjoint(launch, job, pool, slots, mask, p, rgb);
#else
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
      const int field = DERIVATIVE + parts[p].image * RADIANCE_CHANNELS + c;
      STORE(pool, field, slots, LOAD(pool, field, slots) + SELECT(mask, weight[c] * rgb[c], 0.0f));
    }
#endif
  }
#endif
}

#endif
