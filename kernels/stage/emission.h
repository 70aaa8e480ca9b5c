/* The emission of the surface that a path has arrived at, where it is a light. */
#ifndef ITN_STAGE_EMISSION_H
#define ITN_STAGE_EMISSION_H
#include "path/spectral.h"
#include "light/emission.h"
#include "light/light_connection.h"
#include "light/light_sampling.h"
#include "derivative/score.h"
#include "stage/surface.h"

INLINE void gather_emission(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid,
                            const Surface* s) {
#if HAS_AREA_LIGHTS
  MASK shines = valid & (s->light >= 0) & s->front;
  if (job->hide_emitters) shines = shines & (LOAD_INT(pool, DEPTH, slots) > 0);
#if OPERATOR_SINGLE
  shines = shines & (LOAD_INT(pool, DEPTH, slots) >= SCATTERED_ONCE);
#endif
  if (!ANY(shines)) return;
  LightSource source = light_source(SELECT_INT(shines, s->light, job->first_light), s->direction);
  UNROLL_FOR(int c = 0; c < 3; ++c) source.share[c] = (REAL)(1.0f);
#if LIGHT_TEXELS
  source.plain = (REAL)(1.0f);
  source.uv[0] = s->texture[0];
  source.uv[1] = s->texture[1];
#endif
  REAL scale = LOAD(pool, REFRACTION_SCALE, slots);
#if LIGHT_SAMPLING
  /* against having sampled it where the path came from */
  const REAL last_pdf = LOAD(pool, LAST_PDF, slots);
  REAL own = ABS(last_pdf);
#if ROUGH_LIGHT_SAMPLING
  own *= ABS(LOAD(pool, LAST_PDF_DIVISOR, slots));
#endif
  const REAL3 from = load3(pool, ORIGIN, slots), way = sub3(s->position, from);
  const REAL chance = SELECT(last_pdf < 0.0f, (REAL)(LAMP_CANDIDATES), job->light_share) *
                      light_chance(launch, light_chances(job, from), source.index - job->first_light);
  REAL pdf = light_surface_pdf(launch, source.index, chance, SQRT(dot3(way, way)), -dot3(s->direction, s->normal));
#if HAS_AIMED_SHAPES
  pdf *= 1.0f + aimed_competing_pdf(launch, job, pool, slots, shines, s->position, &source);
#endif
  scale *= SELECT(own == 0.0f, 1.0f, own / (own + pdf));
#endif
  REAL weight[3], rgb[3];
  channel_weights(pool, slots, scale, weight);
  light_colour(launch, source.index, rgb);
#if HAS_SCREENS
  screen_colour(launch, source.index, s->texture, source.share);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) rgb[c] *= source.share[c];
#endif
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    weight[c] *= LOAD(pool, THROUGHPUT + (THROUGHPUT_CHANNELS == 1 ? 0 : c), slots);
    rgb[c] *= weight[c];
  }
  const Scores scores = load_scores(job, pool, slots);
  gather_radiance(launch, job, pool, slots, shines, rgb, &scores);
  gather_light_derivatives(launch, job, pool, slots, shines, weight, &source);
#endif
}

#endif
