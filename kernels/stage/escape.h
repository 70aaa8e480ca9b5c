/* Stage escape: the path has left the scene and meets the light around it. */
#ifndef ITN_STAGE_ESCAPE_H
#define ITN_STAGE_ESCAPE_H
#include "path/spectral.h"
#include "light/environment.h"
#include "stage/path_end.h"
#include "light/emission.h"
#include "path/launch.h"
#include "light/light_sampling.h"
#include "derivative/score.h"

INLINE void escape_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  REAL3 direction = load3(pool, DIRECTION, slots);
  REAL light[3];
  environment_radiance(launch->environments + job->environment, launch->light_tables, direction, light);
  REAL scale = LOAD(pool, REFRACTION_SCALE, slots);
#if LIGHT_SAMPLING
  REAL last_pdf = LOAD(pool, LAST_PDF, slots);
  REAL light_pdf = light_sampling_pdf(launch, job, direction, last_pdf < 0.0f);
  scale *= SELECT(last_pdf == 0.0f, 1.0f, ABS(last_pdf) / (ABS(last_pdf) + light_pdf));
#endif
  if (job->hide_emitters) scale = SELECT(LOAD_INT(pool, DEPTH, slots) > 0, scale, 0.0f);
#if OPERATOR_SINGLE
  scale = SELECT(LOAD_INT(pool, DEPTH, slots) >= SCATTERED_ONCE, scale, 0.0f);
#endif
  REAL weight[3];
  channel_weights(pool, slots, scale, weight);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    weight[c] *= LOAD(pool, THROUGHPUT + (THROUGHPUT_CHANNELS == 1 ? 0 : c), slots);
    light[c] *= weight[c];
  }
  const Scores scores = load_scores(job, pool, slots);
  gather_radiance(launch, job, pool, slots, valid, light, &scores);
  const LightSource source = light_around(direction);
  gather_light_derivatives(launch, job, pool, slots, valid, weight, &source);
  finish(launch, job, pool, slots, valid);
}

#endif
