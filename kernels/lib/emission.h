/* Derivatives of the image by parameters of the light. Radiance enters a path's contribution as a factor of its own, so
 * that these need no score: what multiplies the radiance there multiplies its derivative. Light that is linear in its
 * records (constant, environment map, sun) has the derivative that the same code gives for a record of derivatives
 * ("moving", made by emitter_derivative in runtime/compile/emitter.h); that of the sky is printed from its model. Lights of the
 * scene are linear in their colours.
 * Tests: tests/derivative/emission_test.cpp, tests/transport/emission_test.cpp */
#ifndef ITN_EMISSION_H
#define ITN_EMISSION_H
#include "lib/adjoint.h"
#include "lib/launch.h"
#include "lib/light.h"
#include "derivative/score.h"

#if HAS_LIGHT_DERIVATIVES
#if HAS_SUN
/* d: in the local frame */
inline void clear_sky_derivative(__global const EmitterRecord* record, __global const EmitterRecord* moving, REAL3 d,
                                 REAL rgb[3]) {
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

/* Derivative of all light from a direction, by the parameter of `moving`. */
inline void emitter_derivative(__global const EmitterRecord* record, __global const EmitterRecord* moving,
                               __global const float* tables, REAL3 direction, REAL rgb[3]) {
#if HAS_SUN
  if (moving->kind == EMITTER_SUNSKY) {
    REAL sun[3];
    clear_sky_derivative(record, moving, emitter_to_local(record, direction), rgb);
    emitter_sun_radiance(moving, tables, direction, sun);
    UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] += sun[c];
    return;
  }
#endif
  emitter_sky_radiance(moving, tables, direction, rgb);
}
#endif

/* Adds to the derivatives by the light what reaches the lanes in `mask` from where it comes. weight: what the radiance of the
 * light is multiplied by on its way to the pixel. */
inline void gather_light_derivatives(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots,
                                     MASK mask, const REAL weight[RADIANCE_CHANNELS], const LightSource* source) {
#if HAS_LIGHT_DERIVATIVES
#if ADJOINT
  if (!job->replay) return;
#endif
#if HAS_LIGHTS
  INT numbers = GATHER_INT(LIGHT_MEMBER_INT(launch, first_number), max(source->index, 0) * LIGHT_WORDS);
  numbers = SELECT_INT(source->index < 0, -1, numbers);
#endif
  for (int p = 0; p < PARTS + LIGHT_NUMBERS; ++p) { /* not unrolled: one copy of the light's code is long enough */
    const int moving = launch->derivatives[p].emitter, light = launch->derivatives[p].light;
    if (moving < 0 && light < 0) continue;
    REAL rgb[3];
    if (moving >= 0)
      emitter_derivative(launch->emitters + job->emitter, launch->emitters + moving, launch->emitter_tables,
                         source->direction, rgb);
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
