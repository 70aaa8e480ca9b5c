/* Stage medium: free flights and scatterings in a medium until the path meets a surface, ends, or waits for a light
 * connection. Several events a state load: a lane keeps scattering while enough of its group do. What a medium is like
 * stands in scattering/medium.h. */
#ifndef ITN_STAGE_MEDIUM_H
#define ITN_STAGE_MEDIUM_H
#include "path/event_random.h"
#include "path/spectral.h"
#include "path/roulette.h"
#include "derivative/baseline.h"
#include "geometry/frame.h"
#include "path/launch.h"
#include "light/light_connection.h"
#include "scattering/medium.h"
#include "stage/path_end.h"
#include "scattering/phase_score.h"
#include "scattering/probe.h"
#include "stage/ray.h"

#if HAS_MEDIUM
/* Paths between two events in a medium. */
typedef struct {
  INT index; /* of the medium */
  Medium medium;
  Phase phase;
  INT first_cell; /* of the medium's table of expected futures */
  Random random;

  REAL3 position, direction;
  REAL throughput[THROUGHPUT_CHANNELS];
  REAL weight[3]; /* spectral: see path/launch.h */
  REAL refraction_scale;
  INT hero; /* channel, 0 where one sigma_t is that of all */
  INT depth, skip;
  MASK passed;
  FlightCell cell; /* of the position */
  Depth below;
  Scores scores;
  Baseline baseline;

#if VOXEL_SUMS
  ProbeState probe;
#endif
  MASK alive, arrived, dead, escaped; /* alive: still in flight */
  INT hit_primitive;
  REAL hit_u, hit_v;
#if MEDIUM_LIGHT_SAMPLING
  MASK connectable, waiting; /* waiting for a connection with light */
  REAL last_pdf, chance;
  REAL3 vertex; /* where the last flight began; direction of arrival for waiting lanes */
#endif
#if HAS_AREA_LIGHTS && LIGHT_SAMPLING
  REAL3 origin; /* where the direction began */
  REAL last_pdf_divisor;
#endif
} Walk;

/* One event: a flight, and the scattering at its end. */
typedef struct {
  REAL u[4];
  Random random; /* numbers of the event */
  Flight flight;
  REAL distance; /* up to where the path got */
  REAL3 from, there;
  FlightCell end;
  MASK flies, meets, scatters;
#if VOXEL_SUMS
  Probe probe;
#endif
} Event;

INLINE Walk load_walk(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, MASK valid) {
  Walk w;
  w.index = SELECT_INT(valid, LOAD_INT(pool, MEDIUM, slots), 0);
  w.medium = load_medium(launch, w.index);
  w.phase = load_phase(launch, w.index);
  const INT at = w.index * (int)(sizeof(MediumRecord) / sizeof(float));
  w.first_cell = GATHER_INT(((__global const int*)launch->media + FIELD_OF(MediumRecord, first_cell)), at);
  w.random = load_random(job, pool, slots);
  w.position = load3(pool, POSITION, slots);
  w.direction = load3(pool, DIRECTION, slots);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) w.throughput[c] = LOAD(pool, THROUGHPUT + c, slots);
  w.depth = LOAD_INT(pool, DEPTH, slots);
  w.skip = LOAD_INT(pool, SKIP, slots);
  w.passed = LOAD_INT(pool, PASSED, slots) != 0;
  w.weight[0] = w.weight[1] = w.weight[2] = (REAL)(1.0f);
  w.hero = (INT)(0);
#if SPECTRAL
  UNROLL_FOR(int c = 0; c < 3; ++c) w.weight[c] = LOAD(pool, SPECTRAL_WEIGHT + c, slots);
  w.hero = LOAD_INT(pool, HERO, slots);
#endif
  w.scores = load_scores(job, pool, slots);
  w.baseline = load_baseline(pool, slots);
  w.refraction_scale = LOAD(pool, REFRACTION_SCALE, slots);
#if VOXEL_SUMS
  w.probe = load_probe_state(pool, slots);
#endif
  w.alive = valid;
  w.arrived = w.dead = w.escaped = (MASK)(0);
  w.hit_primitive = (INT)(-1);
  w.hit_u = w.hit_v = (REAL)(0.0f);
  w.cell = flight_cell(launch->grid, launch->geometries + job->geometry, w.position);
  w.below = depth_of(&w.cell, typical_sigma_t(&w.medium));
#if MEDIUM_LIGHT_SAMPLING
  w.connectable = HAS_INNER_LIGHTS
                      ? (MASK)(-1)
                      : GATHER_INT(((__global const int*)launch->media + FIELD_OF(MediumRecord, connection)), at) !=
                            CONNECTION_NONE;
  w.waiting = (MASK)(0);
  w.last_pdf = LOAD(pool, LAST_PDF, slots);
  w.chance = (REAL)(1.0f);
  w.vertex = w.position;
#endif
#if HAS_AREA_LIGHTS && LIGHT_SAMPLING
  w.origin = load3(pool, ORIGIN, slots);
  w.last_pdf_divisor = ROUGH_LIGHT_SAMPLING ? LOAD(pool, LAST_PDF_DIVISOR, slots) : (REAL)(1.0f);
#endif
  return w;
}

/* Flights that end at a place which was not drawn as a collision. */
INLINE MASK is_probe(const Event* e) {
#if VOXEL_SUMS
  return e->probe.flies;
#else
  return (MASK)(0);
#endif
}

#if VOXEL_SUMS
/* Flights that become probes end at their places. */
INLINE void end_at_probe(const Launch* launch, __global const JobRecord* job, Walk* w, Event* e) {
  Random next = w->random;
  e->probe = choose_probe(launch, job, &w->medium, &w->random, &w->probe, e->from, w->direction, e->distance,
                          brightest(w->throughput, w->weight), e->flies);
  if (!ANY(e->probe.flies)) return;
  next.event = w->random.event - 1; /* of the probe's event, others than the flight had */
  REAL u[4];
  draw(&next, 0, u);
  UNROLL_FOR(int k = 0; k < 4; ++k) e->u[k] = SELECT(e->probe.flies, u[k], e->u[k]);
  e->distance = SELECT(e->probe.flies, e->probe.distance, e->distance);
  e->there = select3(e->probe.flies, add3(e->from, scale3(w->direction, e->distance)), e->there);
  e->end = flight_cell(launch->grid, launch->geometries + job->geometry, e->there);
  e->scatters = e->scatters | e->probe.flies;
  e->meets = e->meets & !e->probe.flies;
}
#endif

/* A free flight to the next collision, or to a surface before it. */
INLINE Event fly(const Launch* launch, __global const JobRecord* job, Walk* w, REAL mean_free_path) {
  __global const GeometryRecord* geometry = launch->geometries + job->geometry;
  Event e;
  e.flies = w->alive;
  e.random = w->random;
  e.from = w->position;
  draw(&w->random, 0, e.u);
  w->random.event += SELECT_INT(w->alive, 1, 0);
  e.flight = medium_flight(launch, &w->medium, &e.random, e.u[0], w->position, w->direction, w->hero, mean_free_path,
                           w->weight, w->alive);
  const REAL flight = e.flight.distance;
  e.distance = flight;
  e.there = add3(w->position, scale3(w->direction, flight));
  e.end = flight_cell(launch->grid, geometry, e.there);
  const MASK test = w->alive & !flight_is_clear(geometry, &w->cell, &e.end, w->direction, flight);
  e.meets = (MASK)(0);
  if (ANY(test)) {
    const LaneHits hits = trace_lanes(job_surfaces(launch, job), w->position, w->direction, flight, w->skip, w->alive,
                                      (w->skip >= 0) & w->passed, test);
    e.meets = test & (hits.primitive.integer >= 0);
    e.distance = SELECT(e.meets, hits.distance.real, flight);
    e.there = select3(e.meets, make3(hits.x.real, hits.y.real, hits.z.real), e.there);
    w->hit_primitive = SELECT_INT(e.meets, hits.primitive.integer, w->hit_primitive);
    w->hit_u = SELECT(e.meets, hits.u.real, w->hit_u);
    w->hit_v = SELECT(e.meets, hits.v.real, w->hit_v);
  }
  /* sigma_t 0: an endless flight leaves the scene */
  const MASK gone = w->alive & !e.meets & (flight > 1e30f);
  MASK unseen = (MASK)(0);
#if HAS_FAR_CLIP
  /* One that gets to where the camera's sight ends is over, as if it met a black surface there: Mitsuba shows the light around
   * behind the end of rays in vacuum alone. */
  const REAL end = ray_end(launch, job, w->direction, (w->skip < 0) & (w->depth == 0));
  unseen = w->alive & (e.distance > end);
  e.distance = SELECT(unseen, end, e.distance);
  e.there = select3(unseen, add3(w->position, scale3(w->direction, e.distance)), e.there);
  e.meets = e.meets | unseen;
#endif
  e.scatters = w->alive & !e.meets & !gone;
#if VOXEL_SUMS
  end_at_probe(launch, job, w, &e);
#endif
  w->escaped = w->escaped | (gone & !unseen & !is_probe(&e));
  w->dead = w->dead | (unseen & !is_probe(&e));
  w->arrived = w->arrived | (e.meets & !unseen);
#if MEDIUM_LIGHT_SAMPLING
  w->vertex = select3(e.meets, w->position, w->vertex);
#endif
  w->position = select3(e.meets | e.scatters, e.there, w->position);
  return e;
}

/* Throughput with all its factors. */
INLINE void weigh(const Walk* w, REAL total[]) {
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) total[c] = w->throughput[c] * w->refraction_scale * w->weight[c];
}

/* The flight, to scores and baselines. Weighed as after the flight: then the means are zero over the mixture of the hero
 * channels' densities too. state: before the flight */
INLINE void score_flight(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, Walk* w,
                         const Event* e, INT state) {
  REAL total[THROUGHPUT_CHANNELS], column_density[FIELD_CHANNELS];
  weigh(w, total);
  segment_column_density(launch, &w->medium, &e->random, 0, e->from, w->direction, e->distance, e->meets | e->scatters,
                         column_density);
  record_visit(launch, job, pool, slots, &w->random, w->random.event - 1, DECISION_FLIGHT, state, total, e->flies);
  add_medium_flight(launch, job, pool, slots, &w->scores, &w->baseline, &w->medium, column_density, e->meets,
                    e->scatters, total, state);
#if VOXEL_SUMS
  if (job->replay != REPLAY_SUMS) return;
  REAL adjoint[RADIANCE_CHANNELS];
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
    adjoint[c] = w->scores.adjoint.weight[c] - w->scores.adjoint.expected[c];
  sum_way_by_voxels(launch, job, pool, slots, &w->medium, &e->random, 0, e->from, w->direction, e->distance,
                    e->meets | e->scatters, adjoint);
  sum_scattering_by_voxels(launch, job, pool, slots, &w->medium, &e->flight, e->there, e->scatters, adjoint);
#endif
}

#if VOXEL_SUMS
/* Flights that are probes get to their places. state: before the flight */
INLINE void land(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, Walk* w, Event* e,
                 INT state) {
  const MASK lands = e->probe.flies & e->scatters;
  if (!ANY(lands)) return;
  REAL expected[RADIANCE_CHANNELS];
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) expected[c] = (REAL)(0.0f);
#if BASELINES
  REAL total[THROUGHPUT_CHANNELS], v[THROUGHPUT_CHANNELS];
  weigh(w, total);
  expected_future(launch, state, v);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    const int t = THROUGHPUT_CHANNELS == 1 ? 0 : c;
    expected[c] = job->future_tint[c] * total[t] * v[t];
  }
#endif
  const MASK tells = land_probe(launch, pool, slots, &w->medium, &e->probe, e->there, lands, expected);
  w->dead = w->dead | (lands & !tells);
  e->scatters = e->scatters & (tells | !lands);
}
#endif

/* Computes the share of the light that a scattering leaves, a throughput channel each. */
INLINE void albedo_of_scattering(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, Walk* w,
                                 const Event* e, REAL albedo[]) {
  medium_albedo(launch, &w->medium, w->position, e->scatters, albedo);
#if VOXEL_SUMS
  if (job->replay == REPLAY_SUMS)
    sum_albedo_by_voxels(launch, job, pool, slots, &w->medium, w->position, albedo, e->scatters,
                         w->scores.adjoint.weight);
  else
    choose_albedo_probe(launch, job, pool, slots, &w->medium, &w->random, &w->probe, w->position,
                        brightest(w->throughput, w->weight), e->scatters, albedo);
#endif
}

/* Albedo and roulette at the flight's end. `alive` is who goes on. total: of these; future: expected before the
 * change of direction */
INLINE void survive(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, Walk* w, Event* e,
                    REAL total[], REAL future[]) {
  w->skip = SELECT_INT(e->scatters, -1, w->skip);
  w->depth += SELECT_INT(e->scatters, 1, 0);
  REAL albedo[THROUGHPUT_CHANNELS];
  albedo_of_scattering(launch, job, pool, slots, w, e, albedo);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) w->throughput[c] *= SELECT(e->scatters, albedo[c], 1.0f);
  const REAL largest = brightest(w->throughput, w->weight);
#if OPERATOR_SINGLE
  const MASK again = e->scatters & (w->depth >= SCATTERED_ONCE);
  w->dead = w->dead | again;
  e->scatters = e->scatters & !again;
  w->depth += SELECT_INT(e->scatters, SCATTERED_ONCE, 0);
#endif
  const INT vertices = plain_depth(w->depth);
  const MASK may_go_on = e->scatters & (largest > 0.0f) & (vertices < job->max_depth);
  weigh(w, total);
  const MASK dies =
      roulette(launch, job, vertices, e->u[3], e->scatters, largest, ROULETTE_SURVIVAL_IN_MEDIA, w->throughput);
  w->dead = w->dead | dies;
  w->alive = e->scatters & !dies;
  const INT state = medium_state(w->first_cell, DECISION_SCATTER, &w->below, dot3(w->below.normal, w->direction));
  expected_future(launch, state, future);
  REAL change[THROUGHPUT_CHANNELS], raised[THROUGHPUT_CHANNELS];
  weigh(w, raised);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) {
    change[c] = SELECT(may_go_on, SELECT(w->alive, raised[c], 0.0f) - total[c], 0.0f);
    total[c] = raised[c];
  }
  add_roulette(&w->baseline, change, future, &w->scores);
  record_visit(launch, job, pool, slots, &w->random, w->random.event - 1, DECISION_SCATTER, state, total, w->alive);
}

#if MEDIUM_LIGHT_SAMPLING
/* Chooses the lanes that connect with light before going on. u[2] decides; what is left of it is uniform again. */
INLINE MASK choose_connections(const Launch* launch, __global const JobRecord* job, Walk* w, REAL u[4]) {
  const REAL expected =
      connection_chance(launch, job, w->index * (int)(sizeof(MediumRecord) / sizeof(float)), &w->cell, w->direction,
                        brightest(w->throughput, w->weight), typical_sigma_t(&w->medium), &w->phase);
  w->chance = SELECT(w->alive, expected, w->chance);
  const MASK connects = w->alive & w->connectable & (u[2] < w->chance);
  u[2] =
      SELECT(w->connectable, SELECT(u[2] < w->chance, u[2] / w->chance, (u[2] - w->chance) / (1.0f - w->chance)), u[2]);
  w->vertex = select3(connects, w->direction, w->vertex);
  w->waiting = w->waiting | connects;
  return connects;
}
#endif

/* A change of direction by the phase function. */
INLINE void scatter(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, Walk* w, Event* e,
                    const REAL total[], const REAL future[]) {
  const MASK scatters = w->alive;
  place_phase(launch, &w->phase, w->position, scatters);
#if MEDIUM_LIGHT_SAMPLING
  const MASK connects = choose_connections(launch, job, w, e->u);
#endif
  REAL cosine, sine, s, c;
  phase_draw(&w->phase, e->u[1], &cosine, &sine);
  sin_cos_2pi(e->u[2], &s, &c);
  const Frame frame = make_frame(w->direction);
  REAL3 scattered = frame_to_world(&frame, make3(sine * c, sine * s, cosine));
  scattered = scale3(scattered, 1.5f - 0.5f * dot3(scattered, scattered)); /* stays unit over thousands of scatters */
  w->direction = select3(w->alive, scattered, w->direction);
#if HAS_AREA_LIGHTS && LIGHT_SAMPLING
  w->origin = select3(w->alive, w->position, w->origin);
  w->last_pdf_divisor = SELECT(w->alive, 1.0f, w->last_pdf_divisor);
#endif
#if MEDIUM_LIGHT_SAMPLING
  w->last_pdf = SELECT(w->alive, SELECT(w->connectable, phase_value(&w->phase, cosine) / w->chance, 0.0f), w->last_pdf);
  w->alive = w->alive & !connects; /* connected before the path goes on, so contributions keep their order */
#endif
  add_phase_scatter(launch, job, pool, slots, &w->scores, &w->baseline, &w->phase, cosine, total, future, scatters,
                    w->alive);
}

/* Back to the pool, and on to where each path waits next. */
INLINE void store_walk(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid,
                       const Walk* w) {
  store3(pool, POSITION, slots, w->position);
  store3(pool, DIRECTION, slots, w->direction);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) STORE(pool, THROUGHPUT + c, slots, w->throughput[c]);
  store_scores(pool, slots, &w->scores);
  sum_medium(launch, job, pool, slots, &w->scores, &w->medium, valid);
  sum_phase(launch, job, pool, slots, &w->scores, &w->phase, valid);
  store_baseline(pool, slots, &w->baseline);
#if VOXEL_SUMS
  store_probe_state(pool, slots, &w->probe);
#endif
  STORE_INT(pool, EVENT, slots, w->random.event);
  STORE_INT(pool, DEPTH, slots, w->depth);
  STORE_INT(pool, SKIP, slots, w->skip);
  STORE_INT(pool, HIT, slots, w->hit_primitive);
  STORE(pool, HIT_PLACE, slots, w->hit_u);
  STORE(pool, HIT_PLACE + 1, slots, w->hit_v);
#if SPECTRAL
  UNROLL_FOR(int c = 0; c < 3; ++c) STORE(pool, SPECTRAL_WEIGHT + c, slots, w->weight[c]);
#endif
#if HAS_AREA_LIGHTS && LIGHT_SAMPLING
  begin_segment(pool, slots, w->origin, w->last_pdf_divisor, valid);
#endif
  finish(launch, job, pool, slots, w->dead);
  push_surface(launch, job, pool, slots, w->arrived, w->hit_primitive);
  push(pool, QUEUE_ESCAPE, slots, w->escaped);
#if MEDIUM_LIGHT_SAMPLING
  STORE(pool, LAST_PDF, slots, w->last_pdf);
  STORE(pool, CHANCE, slots, w->chance);
  store3(pool, ARRIVAL, slots, w->vertex);
  push(pool, QUEUE_CONNECT, slots, w->waiting);
#endif
  if (ANY(w->alive)) push(pool, QUEUE_MEDIUM, slots, w->alive);
}

/* Leaves the loop when at most `enough` lanes are still in flight; they go back to the queue. */
INLINE void medium_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid,
                         int enough) {
  Walk w = load_walk(launch, job, pool, slots, valid);
  const REAL mean_free_path = 1.0f / of_hero(w.medium.n + MEDIUM_sigma_t, w.hero);
  for (int event = 0; event < MEDIUM_EVENTS; ++event) {
    const INT state = medium_state(w.first_cell, DECISION_FLIGHT, &w.below, dot3(w.below.normal, w.direction));
    Event e = fly(launch, job, &w, mean_free_path);
#if SPECTRAL
    weigh_medium_flight(launch, &w.medium, &e.random, e.from, w.direction, w.hero, mean_free_path, &e.flight,
                        e.distance, e.meets | is_probe(&e), e.scatters & !is_probe(&e), w.weight);
#endif
#if VOXEL_SUMS
    land(launch, job, pool, slots, &w, &e, state);
#endif
    w.cell = e.end; /* who met a surface needs none */
    w.below = depth_of(&w.cell, typical_sigma_t(&w.medium));
    score_flight(launch, job, pool, slots, &w, &e, state);
    REAL total[THROUGHPUT_CHANNELS], future[THROUGHPUT_CHANNELS];
    survive(launch, job, pool, slots, &w, &e, total, future);
    scatter(launch, job, pool, slots, &w, &e, total, future);
    if (popcount(lane_bits(w.alive)) <= enough) break;
  }
  store_walk(launch, job, pool, slots, valid, &w);
}

#endif

#endif
