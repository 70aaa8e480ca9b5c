/* Stage of boundaries between two refractive indices: the path is reflected or refracted. The same for all BSDFs with
 * BSDF_TRANSMITS; `model` and `variant` are constants where this is inlined. */
#ifndef ITN_STAGE_BOUNDARY_H
#define ITN_STAGE_BOUNDARY_H
#include "path/event_random.h"
#include "path/spectral.h"
#include "path/roulette.h"
#include "light/sun.h"
#include "stage/path_end.h"
#include "light/connection.h"
#include "light/light_connection.h"
#include "stage/opaque.h"

/* The path goes on, is reflected or refracted into direction d, or ends by roulette. weight: f cos / p of the sample
 * without the factor of radiance; pdf: LAST_PDF of d; inverse_eta: near over far index where the path is refracted.
 * Radiance scales by inverse_eta^2 on the way (basic radiance is conserved); roulette does not see this factor, as
 * in Mitsuba. straight: through a thin pane, which counts no more than an index-matched boundary; passes: as if the
 * boundary were not there. */
INLINE void scatter_at_boundary(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid,
                                const Surface* s, const Random* random, REAL u, REAL3 d, const REAL weight[], REAL pdf,
                                REAL inverse_eta, MASK straight, MASK passes) {
  REAL throughput[THROUGHPUT_CHANNELS];
  MASK real = valid & !passes;
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c)
    throughput[c] = LOAD(pool, THROUGHPUT + c, slots) * SELECT(real, weight[c], 1.0f);
  INT depth = LOAD_INT(pool, DEPTH, slots) + SELECT_INT(real & !straight, 1, 0);
  REAL weights[3];
  channel_weights(pool, slots, (REAL)(1.0f), weights);
  const REAL largest = brightest(throughput, weights);
  MASK dies = roulette(launch, job, plain_depth(depth), u, real, largest, ROULETTE_SURVIVAL_AT_SURFACES, throughput);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) STORE(pool, THROUGHPUT + c, slots, throughput[c]);
  STORE_INT(pool, DEPTH, slots, depth);
  STORE_INT(pool, EVENT, slots, random->event + 1);
  REAL scale = SELECT(real, inverse_eta * inverse_eta, 1.0f);
  STORE(pool, REFRACTION_SCALE, slots, LOAD(pool, REFRACTION_SCALE, slots) * scale);
  STORE(pool, LAST_PDF, slots, SELECT(real, pdf, LOAD(pool, LAST_PDF, slots)));
  leave_surface(launch, pool, slots, valid & !dies, s, select3(passes, s->direction, d));
  finish(launch, job, pool, slots, dies);
}

#if ROUGH_LIGHT_SAMPLING
/* Density of the connection over that of phase function and flight, which may underflow; 0 where no connection is
 * drawn. */
INLINE REAL competing_density(REAL connection, REAL by_phase, MASK mask) {
  return SELECT(mask & (connection > 0.0f), connection / MAX(by_phase, (REAL)(1e-30f)), 0.0f);
}

/* Densities of the connections through the boundary (connect.h) over those of phase function and flight: of the sampled
 * direction to the sun or a light that is aimed at, and of the path's own to the light around. 0 where the segment did not begin
 * at a scattering vertex, or light is inside. Returns where it did; then the path knows what its own direction to a shape that
 * shines needs for the same (`aimed_competing_pdf`). */
INLINE MASK competing_densities(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots,
                                MASK at_boundary, const Surface* s, const LightSample* light, REAL3 direction,
                                REAL* competing_pdf, REAL* own_competing_pdf) {
  *competing_pdf = *own_competing_pdf = (REAL)(0.0f);
#if MEDIUM_LIGHT_SAMPLING && REFRACTED_CONNECTIONS
  const REAL last_pdf = LOAD(pool, LAST_PDF, slots);
  const INT medium = SELECT_INT(at_boundary, LOAD_INT(pool, MEDIUM, slots), -1); /* idle lanes hold anything */
  const INT at = max(medium, 0) * (int)(sizeof(MediumRecord) / sizeof(float));
  __global const int* media = (__global const int*)launch->media;
  /* SKIP -1: the flight did not begin at a boundary, from where nothing was connected */
  const MASK from_medium = !s->front & (last_pdf > 0.0f) & (medium >= 0) & (LOAD_INT(pool, SKIP, slots) == -1) &
                           (GATHER_INT((media + FIELD_OF(MediumRecord, connection)), at) == CONNECTION_REFRACTED);
  if (!ANY(from_medium)) return from_medium;
  const AssumedBoundary boundary = assumed_boundary(launch, at);
  const Medium inside = load_medium(launch, max(medium, 0));
  const REAL3 vertex = load3(pool, ARRIVAL, slots), segment = sub3(s->position, vertex);
  const REAL by_phase = last_pdf * medium_transmittance(typical_sigma_t(&inside), SQRT(dot3(segment, segment)));
  const FlightCell cell = flight_cell(launch->grid, launch->geometries + job->geometry, vertex);
  const REAL3 guess = surface_normal_guess(&cell);
  REAL3 aim = light->source.direction;
  MASK drawn = from_medium & (light->source.index < 0) & (dot3(aim, s->normal) > 0.0f);
#if HAS_AIMED_LIGHTS
  const MASK aimed = from_medium & is_reached(launch, light->source.index, LIGHT_AIMED_AT);
  drawn = (REFRACTED_AROUND ? drawn : (MASK)(0)) | (aimed & (dot3(aim, s->normal) > 0.0f));
  aim = aim_at_light(launch, job, &cell, vertex, &light->source, s->position, light->distance);
#endif
  *competing_pdf = competing_density(refracted_pdf(&boundary, guess, aim, s->direction), by_phase, drawn);
#if HAS_AIMED_LIGHTS
  const REAL at_vertex = chance_of_light(launch, job, vertex, light->source.index);
  const REAL here = chance_of_light(launch, job, s->position, light->source.index);
  *competing_pdf *= SELECT(aimed, at_vertex / MAX(here, (REAL)(1e-9f)), 1.0f);
#endif
#if HAS_AIMED_SHAPES
  store3(pool, EXIT_VERTEX, slots, vertex);
  STORE(pool, EXIT_DENSITY, slots, by_phase);
  STORE_INT(pool, EXIT_MEDIUM, slots, max(medium, 0));
#endif
#if REFRACTED_AROUND
  MASK finds_light = from_medium & (dot3(direction, s->normal) > 0.0f);
#if HAS_SUN
  finds_light = finds_light & in_sun(launch->environments + job->environment, direction);
#endif
  if (ANY(finds_light))
    *own_competing_pdf =
        competing_density(refracted_pdf(&boundary, guess, direction, s->direction), by_phase, finds_light);
#endif
  return from_medium;
#else
  return (MASK)(0);
#endif
}

/* Computes the factors by which the path's light is multiplied. */
INLINE void path_weight(const Pool* pool, INT slots, REAL factor[RADIANCE_CHANNELS]) {
  REAL weight[3];
  channel_weights(pool, slots, LOAD(pool, REFRACTION_SCALE, slots), weight);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
    factor[c] = weight[c] * LOAD(pool, THROUGHPUT + (THROUGHPUT_CHANNELS == 1 ? 0 : c), slots);
}

/* The one direction to the light around the scene that is sampled where media lie behind. Returns which lanes get light
 * from it by `weight`. */
INLINE MASK sample_around_at_boundary(int model, int variant, const Launch* launch, __global const JobRecord* job,
                                      Pool* pool, INT slots, MASK at_boundary, const Surface* s, Reflector* r,
                                      const Random* random, REAL3 direction, LightSample* sample,
                                      REAL weight[RADIANCE_CHANNELS], REAL* own_competing_pdf, MASK* is_exit) {
  REAL u[4];
  draw(random, 1, u);
  const MASK sampled = sample_light(launch, job, s->position, u, sample);
  const REAL3 wo = frame_to_local(&r->frame, sample->source.direction);
  REAL f[CHANNELS];
  bsdf_measure(model, launch, r->n, r->wi, wo);
  bsdf_value(model, variant, r->n, r->wi, wo, f);
  const REAL bsdf_pdf = bsdf_density(model, variant, r->n, r->wi, wo);
  MASK lit = (MASK)(0);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) lit = lit | (f[c] > 0.0f);
  REAL competing_pdf;
  *is_exit = competing_densities(launch, job, pool, slots, at_boundary, s, sample, direction, &competing_pdf,
                                 own_competing_pdf) &
             (dot3(direction, s->normal) > 0.0f);
  const REAL mis = sample->pdf / (sample->pdf * (1.0f + competing_pdf) + sample->by_chance * bsdf_pdf);
  REAL of_channel[3];
  channel_weights(pool, slots, (REAL)(1.0f), of_channel);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    const int t = THROUGHPUT_CHANNELS == 1 ? 0 : c;
    const REAL scale = LOAD(pool, REFRACTION_SCALE, slots) * f[t] * mis / sample->pdf;
    weight[c] = of_channel[c] * scale * LOAD(pool, THROUGHPUT + t, slots);
  }
  return sampled & lit;
}

/* Light sampled where the path meets the boundary: outside of it; on both sides of thin ones and structures, and where lights
 * may be inside. Three ways lead from a scattering vertex x over the exit y to the light around in direction o, weighed by the
 * balance heuristic: the phase function and the flight bring the path to y and (A) that light is sampled there or (B) the BSDF
 * finds it; or (C) o and the direction of the segment are drawn at x (connect.h). What A and B share cancels;
 * `competing_pdf` is C's density over theirs. To lights that are aimed at lead A and C, which draw them with the chances
 * of their own places, and to those of them that are shapes B (aimed_competing_pdf); to other lights of the scene lead A
 * and B alone, and so they do where the BSDF is broad.
 * Returns LAST_PDF for the BSDF's own direction, of density pdf. */
INLINE REAL sample_light_at_boundary(int model, int variant, const Launch* launch, __global const JobRecord* job,
                                     Pool* pool, INT slots, MASK at_boundary, const Surface* s, Reflector* r,
                                     const Random* random, REAL3 direction, REAL pdf, MASK passes) {
  const int traits = bsdf_traits(model);
  const bool broad = (traits & BSDF_BROAD) != 0;
  const bool both_sides = HAS_INNER_LIGHTS || (traits & (BSDF_THIN | BSDF_STRUCTURE)) != 0;
  const INT depth = LOAD_INT(pool, DEPTH, slots) + 1;
  LightSample sample;
  REAL connection_weight[RADIANCE_CHANNELS], own_competing_pdf = (REAL)(0.0f);
  MASK lit, is_exit = (MASK)(0);
  if (broad) {
    REAL factor[RADIANCE_CHANNELS];
    path_weight(pool, slots, factor);
    lit = choose_light(model, variant, launch, job, s, r, random, factor, &sample, connection_weight);
  } else
    lit = sample_around_at_boundary(model, variant, launch, job, pool, slots, at_boundary, s, r, random, direction,
                                    &sample, connection_weight, &own_competing_pdf, &is_exit);
  const REAL3 light = sample.source.direction, wo = frame_to_local(&r->frame, light);
  bsdf_measure(model, launch, r->n, r->wi, wo);
  const MASK above = dot3(light, s->normal) > 0.0f;
  MASK mask = at_boundary & (plain_depth(depth) < job->max_depth) & lit;
  if (!both_sides) mask = mask & above;
#if OPERATOR_SINGLE
  mask = mask & (depth >= SCATTERED_ONCE);
#endif
  const Scores scores = load_scores(job, pool, slots);
  const Step step = bsdf_step(model, variant, r->n, s->first_number, r->wi, wo, mask);
  ConnectionStart start = connection_start(mask);
  start.model = model;
  start.n = r->n;
  start.texture = s->texture;
  start.surface = &step;
  add_connection(launch, job, pool, slots, random, mask,
                 beside_surface(launch->primitives, s->primitive, s->position, s->normal, light), &sample, s->primitive,
                 medium_behind(pool, slots, s, both_sides ? above : (MASK)(-1)), connection_weight, &scores, &start);
  begin_segment(pool, slots, s->position, SELECT(is_exit, -1.0f, 1.0f) * (1.0f + own_competing_pdf),
                at_boundary & !passes);
  if (!both_sides) pdf = SELECT(dot3(direction, s->normal) > 0.0f, pdf, 0.0f);
  const REAL last_pdf =
      MAX(pdf / (1.0f + own_competing_pdf), (REAL)(1e-30f)); /* 0 would say that light was not sampled */
  return SELECT(pdf > 0.0f, broad ? -last_pdf : last_pdf, 0.0f);
}
#endif

/* Is some score by a number on which the densities that the model samples depend? */
INLINE bool decides(int model) {
  if (ADJOINT) return true;
  UNROLL_FOR(int k = 0; k < SCORES; ++k)
    if (carried[k].model == model && role_of(model, carried[k].slot) == ROLE_DENSITY) return true;
  return false;
}

/* The baseline's part of what was decided; samples that are lost count too, or its mean would not be zero. */
INLINE void decide_at_boundary(int model, int variant, const Launch* launch, __global const JobRecord* job, Pool* pool,
                               INT slots, const Surface* s, const Reflector* r, const Random* random, REAL3 wo,
                               MASK reflected, MASK mask, Scores* scores) {
#if BASELINES
  if (!(bsdf_traits(model) & BSDF_BASELINE) || !decides(model)) return;
  const INT state = boundary_state(s->first_cell, r->wi.z);
  REAL weight[3], total[THROUGHPUT_CHANNELS], future[THROUGHPUT_CHANNELS];
  channel_weights(pool, slots, LOAD(pool, REFRACTION_SCALE, slots), weight);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) total[c] = LOAD(pool, THROUGHPUT + c, slots) * weight[c];
  record_visit(launch, job, pool, slots, random, random->event, DECISION_FLIGHT, state, total, mask);
  expected_future(launch, state, future);
  const Step step =
      bsdf_decision_step(model, variant, r->n, s->first_number, r->wi, wo, SELECT(reflected, 1.0f, 0.0f), mask);
  add_lobe(job, pool, slots, scores, model, r->n, &step, total, future);
#endif
}

INLINE void boundary_stage(int model, int variant, const Launch* launch, __global const JobRecord* job, Pool* pool,
                           INT slots, MASK valid) {
  const bool smooth = (bsdf_traits(model) & BSDF_SMOOTH) != 0;
  const Surface s = load_surface(launch, job, pool, slots, valid, false);
  gather_emission(launch, job, pool, slots, valid, &s);
  const Random random = load_random(job, pool, slots);
  REAL u[4];
  draw(&random, 0, u);
  Reflector r = load_reflector(launch, model, &s, (MASK)(0));
  const MASK passes = pick_leaf(model, &random, &r);
  const MASK scatters = valid & !s.misplaced;
  REAL3 wo;
  REAL weight[CHANNELS], pdf, inverse_eta;
  bsdf_sample(model, variant, launch, r.n, r.wi, u, &wo, weight, &pdf, &inverse_eta);
  const REAL3 direction = frame_to_world(&r.frame, wo);
  const REAL drawn_pdf = pdf;
#if ROUGH_LIGHT_SAMPLING
  if (!smooth)
    pdf = sample_light_at_boundary(model, variant, launch, job, pool, slots, scatters, &s, &r, &random, direction, pdf,
                                   passes);
#else
  pdf = (REAL)(0.0f);
#endif
  Scores scores = load_scores(job, pool, slots);
  decide_at_boundary(model, variant, launch, job, pool, slots, &s, &r, &random, wo, inverse_eta == 1.0f, scatters,
                     &scores);
  MASK found = (MASK)(0);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) found = found | (weight[c] > 0.0f);
  bsdf_measure(model, launch, r.n, r.wi, wo);
  const Step step = bsdf_sample_step(model, variant, r.n, s.first_number, r.wi, wo, drawn_pdf, scatters & found);
  add_scores(job, &scores, model, r.n, &step, false);
  store_scores(pool, slots, &scores);
  sum_scores(launch, job, pool, slots, &scores, model, s.first_number, s.texture, valid);
  scatter_at_boundary(launch, job, pool, slots, valid, &s, &random, u[bsdf_random(model)], direction, weight, pdf,
                      inverse_eta, bsdf_straight(model, r.n, r.wi, wo), s.misplaced | passes);
  if (bsdf_traits(model) & BSDF_PASSES) STORE_INT(pool, PASSED, slots, SELECT_INT(passes, 1, 0));
}

#endif
