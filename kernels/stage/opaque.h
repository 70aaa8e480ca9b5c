/* Stage of surfaces that do not transmit: light is sampled, and the path is reflected. The same for all BSDFs without
 * BSDF_TRANSMITS; `model` and `variant` are constants where this is inlined. */
#ifndef ITN_STAGE_OPAQUE_H
#define ITN_STAGE_OPAQUE_H
#include "path/event_random.h"
#include "path/spectral.h"
#include "path/roulette.h"
#include "stage/path_end.h"
#include "light/connection.h"
#include "stage/emission.h"
#include "stage/light_choice.h"

#if LIGHT_SAMPLING
/* Samples the light. weight: throughput of the path with its spectral weights, before the reflection; even: after it, of a
 * BSDF whose value is a weight times its density. */
INLINE void connect_reflector(int model, int variant, const Launch* launch, __global const JobRecord* job, Pool* pool,
                              INT slots, MASK mask, const Surface* s, Reflector* r, const Random* random, INT depth,
                              const REAL throughput[], const REAL spectral[3]) {
  const Scores scores = load_scores(job, pool, slots);
  REAL factor[RADIANCE_CHANNELS], connection_weight[RADIANCE_CHANNELS];
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    factor[c] = throughput[THROUGHPUT_CHANNELS == 1 ? 0 : c] * spectral[c] * LOAD(pool, REFRACTION_SCALE, slots);
#if OPERATOR_SINGLE
    factor[c] = SELECT(depth >= SCATTERED_ONCE, factor[c], 0.0f);
#endif
  }
  LightSample light;
  const MASK lit = choose_light(model, variant, launch, job, s, r, random, factor, &light, connection_weight);
  const REAL3 to_light = light.source.direction, wo = frame_to_local(&r->frame, to_light);
  bsdf_measure(model, launch, r->n, r->wi, wo);
  const Step step = bsdf_step(model, variant, r->n, s->first_number, r->wi, wo, mask);
  ConnectionStart start = connection_start(mask);
  start.model = model;
  start.n = r->n;
  start.texture = s->texture;
  start.surface = &step;
  add_connection(launch, job, pool, slots, random, mask & lit,
                 beside_surface(launch->primitives, s->primitive, s->position, s->normal, to_light), &light,
                 s->primitive, medium_behind(pool, slots, s, dot3(to_light, s->normal) > 0.0f), connection_weight,
                 &scores, &start);
}
#endif

/* Light that arrives from `wo`, to the scores of the paths that go on. */
INLINE void score_reflection(int model, int variant, const Launch* launch, __global const JobRecord* job, Pool* pool,
                             INT slots, MASK mask, const Surface* s, Reflector* r, REAL3 wo, REAL pdf) {
  bsdf_measure(model, launch, r->n, r->wi, wo);
  Scores scores = load_scores(job, pool, slots);
  const Step step = bsdf_sample_step(model, variant, r->n, s->first_number, r->wi, wo, pdf, mask);
  add_scores(job, &scores, model, r->n, &step, false);
  store_scores(pool, slots, &scores);
  sum_scores(launch, job, pool, slots, &scores, model, s->first_number, s->texture, mask);
}

INLINE void opaque_stage(int model, int variant, const Launch* launch, __global const JobRecord* job, Pool* pool,
                         INT slots, MASK valid) {
  const int traits = bsdf_traits(model);
  const Surface s = load_surface(launch, job, pool, slots, valid, (traits & BSDF_PASSES) == 0);
  gather_emission(launch, job, pool, slots, valid, &s);
  const Random random = load_random(job, pool, slots);
  REAL u[4];
  draw(&random, 0, u);
  const REAL cos_i = -dot3(s.direction, s.frame);
  const bool structure = (traits & BSDF_STRUCTURE) != 0; /* whose leaves tell the sides apart */
  const MASK twosided = structure ? (MASK)(-1) : s.twosided;
  const MASK reflects = valid & ((cos_i > 0.0f) | ((cos_i < 0.0f) & twosided));
  Reflector r = load_reflector(launch, model, &s, structure ? (MASK)(0) : cos_i < 0.0f);
  const MASK passes = pick_leaf(model, &random, &r);

  REAL3 wo;
  REAL weight[CHANNELS], pdf, same_side;
  bsdf_sample(model, variant, launch, r.n, r.wi, u, &wo, weight, &pdf, &same_side);
  REAL throughput[THROUGHPUT_CHANNELS], arriving[THROUGHPUT_CHANNELS], spectral[3];
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) {
    arriving[c] = LOAD(pool, THROUGHPUT + c, slots);
    throughput[c] = arriving[c] * weight[c];
  }
  channel_weights(pool, slots, (REAL)(1.0f), spectral);
  const INT depth = LOAD_INT(pool, DEPTH, slots) + 1;
  const REAL largest = brightest(throughput, spectral);
  const MASK dies = roulette(launch, job, plain_depth(depth), u[bsdf_random(model)], reflects & !passes, largest,
                             ROULETTE_SURVIVAL_AT_SURFACES, throughput);
  const MASK goes_on = reflects & !dies;
  /* where a lost sample says nothing of the others, roulette comes first: paths that end here need no light */
  const bool even = (traits & BSDF_EVEN) != 0;
#if LIGHT_SAMPLING
  if (!even && !(traits & BSDF_SMOOTH))
    connect_reflector(model, variant, launch, job, pool, slots, reflects & (plain_depth(depth) < job->max_depth), &s,
                      &r, &random, depth, arriving, spectral);
#endif
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) STORE(pool, THROUGHPUT + c, slots, throughput[c]);
  STORE_INT(pool, EVENT, slots, random.event + 1);
  STORE_INT(pool, DEPTH, slots, depth - SELECT_INT(passes, 1, 0));
  finish(launch, job, pool, slots, valid & !goes_on);
#if LIGHT_SAMPLING
  if (even)
    connect_reflector(model, variant, launch, job, pool, slots, goes_on, &s, &r, &random, depth, throughput, spectral);
  const REAL last_pdf = (traits & BSDF_SMOOTH) ? (REAL)(0.0f) : -pdf;
  STORE(pool, LAST_PDF, slots, SELECT(passes, LOAD(pool, LAST_PDF, slots), last_pdf));
#else
  STORE(pool, LAST_PDF, slots, 0.0f);
#endif
  begin_segment(pool, slots, s.position, (REAL)(1.0f), goes_on & !passes);
  score_reflection(model, variant, launch, job, pool, slots, goes_on, &s, &r, wo, pdf);
  leave_surface(launch, pool, slots, goes_on, &s, select3(passes, s.direction, frame_to_world(&r.frame, wo)));
  if (traits & BSDF_PASSES) STORE_INT(pool, PASSED, slots, SELECT_INT(passes, 1, 0));
}

#endif
