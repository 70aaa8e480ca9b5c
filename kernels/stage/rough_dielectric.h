/* Stage rough dielectric: a microfacet boundary between two refractive indices. */
#ifndef ITN_STAGE_ROUGH_DIELECTRIC_H
#define ITN_STAGE_ROUGH_DIELECTRIC_H
#include "lib/baseline.h"
#include "lib/light_connection.h"
#include "lib/optical_depth.h"
#include "model/medium_homogeneous.h"
#include "model/rough_dielectric.h"
#include "stage/boundary.h"

#if HAS_ROUGH_BECKMANN || HAS_ROUGH_GGX
#if ROUGH_LIGHT_SAMPLING
/* Density of the connection over that of phase function and flight, which may underflow; 0 where no connection is drawn. */
inline REAL rival_density(REAL connection, REAL by_phase, MASK mask) {
  return SELECT(mask & (connection > 0.0f), connection / MAX(by_phase, (REAL)(1e-30f)), 0.0f);
}

/* The sun sampled where the path meets the boundary. Three ways lead from a scattering vertex x over the exit y to the
 * sun in direction o, weighed by the balance heuristic: the phase function and the flight bring the path to y and (A)
 * the sun is sampled there or (B) the BSDF finds it; or (C) o and the direction of the segment are drawn at x
 * (connect.h). What A and B share cancels; `rival` is C's density over theirs, 0 where the segment did not begin at a
 * scattering vertex. Returns LAST_PDF for the BSDF's own direction. */
inline REAL sample_sun_at_boundary(int distribution, const Launch* launch, __global const JobRecord* job, Pool* pool,
                                   INT slots, MASK at_boundary, const Surface* s, const Frame* frame, const Random* random,
                                   REAL alpha, REAL eta_inside, REAL eta, REAL3 wi, REAL3 direction, REAL pdf) {
  __global const EmitterRecord* emitter = launch->emitters + job->emitter;
  REAL u[4];
  draw(random, 1, u);
  REAL3 light;
  REAL light_pdf, rgb[3];
  const MASK sampled = sample_light(launch, emitter, (MASK)(0), u, &light, &light_pdf, rgb);
  const REAL3 wo = frame_to_local(frame, light);
  const REAL value = rough_dielectric_eval(distribution, alpha, eta, wi, wo);
  const REAL bsdf_pdf = rough_dielectric_pdf(distribution, alpha, eta, wi, wo);
  const INT depth = LOAD_INT(pool, DEPTH, slots) + 1;
  MASK mask =
      at_boundary & sampled & (plain_depth(depth) < job->max_depth) & (value > 0.0f) & (dot3(light, s->normal) > 0.0f);
#if OPERATOR_SINGLE
  mask = mask & (depth >= SCATTERED_ONCE);
#endif
  REAL rival = (REAL)(0.0f), own_rival = (REAL)(0.0f);
#if MEDIUM_LIGHT_SAMPLING
  const REAL last_pdf = LOAD(pool, LAST_PDF, slots);
  const INT medium = SELECT_INT(at_boundary, LOAD_INT(pool, MEDIUM, slots), -1); /* idle lanes hold anything */
  const INT at = max(medium, 0) * (int)(sizeof(MediumRecord) / sizeof(float));
  __global const float* media = (__global const float*)launch->media;
  /* SKIP -1: the flight did not begin at a boundary, from where nothing was connected */
  const MASK from_medium =
      !s->front & (last_pdf > 0.0f) & (medium >= 0) & (LOAD_INT(pool, SKIP, slots) == -1) &
      (GATHER_INT(((__global const int*)media + FIELD_OF(MediumRecord, connection)), at) == CONNECTION_REFRACTED);
  if (ANY(from_medium)) {
    const AssumedBoundary boundary = assumed_boundary(launch, at);
    REAL sigma_t[THROUGHPUT_CHANNELS];
    UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c)
      sigma_t[c] = GATHER((media + FIELD_OF(MediumRecord, sigma_t) + c), at);
    const REAL3 vertex = load3(pool, VERTEX_X, slots), segment = sub3(s->position, vertex);
    const REAL by_phase = last_pdf * medium_transmittance(mean_sigma_t(sigma_t), SQRT(dot3(segment, segment)));
    const FlightCell cell = flight_cell(launch->grid, launch->geometries + job->geometry, vertex);
    const REAL3 guess = surface_normal_guess(&cell);
    rival = rival_density(refracted_pdf(&boundary, guess, light, s->direction), by_phase, from_medium);
    const MASK finds_sun = from_medium & emitter_in_sun(emitter, direction);
    if (ANY(finds_sun))
      own_rival = rival_density(refracted_pdf(&boundary, guess, direction, s->direction), by_phase, finds_sun);
  }
#endif
  const REAL mis = light_pdf / (light_pdf * (1.0f + rival) + bsdf_pdf);
  const REAL scale = LOAD(pool, REFRACTION_SCALE, slots) * value * mis / light_pdf;
  REAL weight[3];
  channel_weights(pool, slots, scale, weight);
  const MASK reflects = wi.z * wo.z > 0.0f;
  REAL connection_weight[RADIANCE_CHANNELS];
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c)
    connection_weight[c] = weight[c] * LOAD(pool, THROUGHPUT + (THROUGHPUT_CHANNELS == 1 ? 0 : c), slots) *
                           boundary_tint(launch, s->bsdf, reflects, c);
  const Scores scores = load_scores(job, pool, slots);
  const MediumStep in_vacuum = no_medium_step((INT)(0));
  SurfaceStep step = no_surface_step();
  step_rough_boundary(distribution, &step, s->bsdf, alpha, eta_inside, wi, wo, mask);
  add_connection(launch, job, pool, slots, mask,
                 beside_surface(launch->primitives, s->primitive, s->position, s->normal, light), light, s->primitive,
                 s->exterior, connection_weight, rgb, &scores, &in_vacuum, &step);
  return MAX(pdf / (1.0f + own_rival), (REAL)(1e-30f)); /* not 0: that would say that the sun was not sampled */
}
#endif

/* The baseline's part of the sampled normal and lobe; samples that are lost count too, or its mean would not be zero. */
inline void decide_at_boundary(int distribution, const Launch* launch, __global const JobRecord* job, Pool* pool,
                               INT slots, INT bsdf, const Random* random, REAL alpha, REAL eta_inside, REAL3 wi, REAL3 wo,
                               MASK reflects, MASK mask, Scores* scores) {
#if BASELINES
  bool by_roughness = ADJOINT;
  UNROLL for (int k = 0; k < SCORES; ++k) by_roughness |= carried[k].kind == SCORE_ALPHA;
  if (!by_roughness) return;
  const INT first_cell = GATHER_INT(((__global const int*)launch->bsdfs + FIELD_OF(BsdfRecord, first_cell)),
                                    bsdf * (int)(sizeof(BsdfRecord) / sizeof(float)));
  const INT state = boundary_state(first_cell, wi.z);
  REAL weight[3], total[THROUGHPUT_CHANNELS], future[THROUGHPUT_CHANNELS];
  channel_weights(pool, slots, LOAD(pool, REFRACTION_SCALE, slots), weight);
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) total[c] = LOAD(pool, THROUGHPUT + c, slots) * weight[c];
  record_visit(launch, job, pool, slots, random, random->event, DECISION_FLIGHT, state, total, mask);
  expected_future(launch, state, future);
  const REAL eta = far_over_near(eta_inside, wi.z), reflected = SELECT(reflects, 1.0f, 0.0f);
  const REAL3 m = rough_dielectric_normal(eta, wi, wo, reflected);
  const SurfaceStep step = step_decision_at_boundary(distribution, bsdf, alpha, eta_inside, wi, m, reflected, mask);
  add_lobe(job, pool, slots, scores, &step, total, future);
#endif
}

/* distribution: a constant where this is inlined. */
inline void rough_dielectric_stage(int distribution, const Launch* launch, __global const JobRecord* job, Pool* pool,
                                   INT slots, MASK valid) {
  Surface s = load_surface(launch, job, pool, slots, valid);
  Random random = load_random(job, pool, slots);
  REAL u[4];
  draw(&random, 0, u);
  const REAL alpha = bsdf_real(launch, s.bsdf, FIELD_OF(BsdfRecord, alpha));
  const REAL eta_inside = bsdf_real(launch, s.bsdf, FIELD_OF(BsdfRecord, eta));
  const Frame frame = make_frame(s.frame);
  const REAL3 wi = scale3(frame_to_local(&frame, s.direction), -1.0f);
  const REAL eta = far_over_near(eta_inside, wi.z); /* far side over near side */
  REAL3 wo;
  REAL weight, pdf;
  MASK reflects;
  rough_dielectric_sample(distribution, alpha, eta, wi, u[0], u[1], u[2], &wo, &weight, &pdf, &reflects);
  /* the factor 1 / eta^2 of radiance goes into REFRACTION_SCALE */
  weight *= SELECT(reflects, 1.0f, eta * eta);
  const REAL3 direction = frame_to_world(&frame, wo);
#if ROUGH_LIGHT_SAMPLING
  pdf = sample_sun_at_boundary(distribution, launch, job, pool, slots, valid & !s.misplaced, &s, &frame, &random, alpha,
                               eta_inside, eta, wi, direction, pdf);
#else
  pdf = (REAL)(0.0f);
#endif
  Scores scores = load_scores(job, pool, slots);
  decide_at_boundary(distribution, launch, job, pool, slots, s.bsdf, &random, alpha, eta_inside, wi, wo, reflects,
                     valid & !s.misplaced, &scores);
  SurfaceStep step = no_surface_step();
  step_rough_boundary(distribution, &step, s.bsdf, alpha, eta_inside, wi, wo, valid & !s.misplaced & (weight > 0.0f));
  add_surface_step(job, &scores, &step);
  store_scores(launch, job, pool, slots, &scores, valid);
  scatter_at_boundary(launch, job, pool, slots, valid, &s, &random, u[3], direction, weight, pdf, reflects, 1.0f / eta);
}

#endif

#endif
