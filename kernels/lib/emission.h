/* Derivatives of the image by parameters of the light. Radiance enters a path's contribution as a factor of its own, so
 * that these need no score: what multiplies the radiance there multiplies its derivative. Light that is linear in its
 * record has the derivative that the same code gives for a record of derivatives ("moving", made by environment_derivative in
 * runtime/compile/environment.h); that of the sky is printed from its model. Lights of the scene are linear in their colours.
 * Tests: tests/derivative/emission_test.cpp, tests/transport/emission_test.cpp */
#ifndef ITN_EMISSION_H
#define ITN_EMISSION_H
#include "lib/adjoint.h"
#include "lib/launch.h"
#include "lib/light.h"
#include "derivative/score.h"

/* Adds to the derivatives by the light what reaches the lanes in `mask` from where it comes. weight: what the radiance of the
 * light is multiplied by on its way to the pixel. */
inline void gather_light_derivatives(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots,
                                     MASK mask, const REAL weight[RADIANCE_CHANNELS], const LightSource* source) {
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
    pull_light(launch, job, pool, slots, mask, p, rgb);
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
