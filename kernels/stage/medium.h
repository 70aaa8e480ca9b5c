/* Stage medium: free flights and scatterings in a homogeneous medium until the path meets a surface, ends, or waits for
 * a light connection. Several events a state load: a lane keeps scattering while enough of its group do. */
#ifndef ITN_STAGE_MEDIUM_H
#define ITN_STAGE_MEDIUM_H
#include "lib/baseline.h"
#include "lib/frame.h"
#include "lib/launch.h"
#include "lib/light_connection.h"
#include "lib/score.h"
#include "model/phase_henyey_greenstein.h"
#include "stage/ray.h"

#if HAS_MEDIUM
/* Leaves the loop when at most `enough` lanes are still in flight; they go back to the queue. */
inline void medium_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid,
                         int enough) {
  __global const GeometryRecord* geometry = launch->geometries + job->geometry;
  const Surfaces surfaces = job_surfaces(launch, job);
  REAL3 position = load3(pool, POSITION_X, slots), direction = load3(pool, DIRECTION_X, slots);
  REAL throughput[THROUGHPUT_CHANNELS];
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) throughput[c] = LOAD(pool, THROUGHPUT + c, slots);
  Random random = load_random(job, pool, slots);
  INT depth = LOAD_INT(pool, DEPTH, slots), skip = LOAD_INT(pool, SKIP, slots);
  const MASK passed = LOAD_INT(pool, PASSED, slots) != 0;

  INT medium = SELECT_INT(valid, LOAD_INT(pool, MEDIUM, slots), 0) * (int)(sizeof(MediumRecord) / sizeof(float));
  __global const float* media = (__global const float*)launch->media;
  REAL sigma_t[THROUGHPUT_CHANNELS], albedo[THROUGHPUT_CHANNELS];
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) {
    sigma_t[c] = GATHER((media + FIELD_OF(MediumRecord, sigma_t) + c), medium);
    albedo[c] = GATHER((media + FIELD_OF(MediumRecord, albedo) + c), medium);
  }
  REAL g = GATHER((media + FIELD_OF(MediumRecord, g)), medium);
  REAL weight[3] = {(REAL)(1.0f), (REAL)(1.0f), (REAL)(1.0f)};
#if SPECTRAL
  UNROLL for (int c = 0; c < 3; ++c) weight[c] = LOAD(pool, SPECTRAL_WEIGHT + c, slots);
  INT hero = LOAD_INT(pool, HERO, slots);
  REAL sigma = SELECT(hero == 0, sigma_t[0], SELECT(hero == 1, sigma_t[1], sigma_t[2]));
#else
  REAL sigma = sigma_t[0];
#endif
  REAL mean_free_path = 1.0f / sigma;
  const INT medium_index = LOAD_INT(pool, MEDIUM, slots);
  Scores scores = load_scores(job, pool, slots);
  Baseline baseline = load_baseline(pool, slots);
  const INT first_cell = GATHER_INT(((__global const int*)media + FIELD_OF(MediumRecord, first_cell)), medium);
  const REAL refraction_scale = LOAD(pool, REFRACTION_SCALE, slots);

  MASK alive = valid, arrived = (MASK)(0), dead = (MASK)(0), escaped = (MASK)(0);
#if MEDIUM_LIGHT_SAMPLING
  MASK connectable =
      GATHER_INT(((__global const int*)media + FIELD_OF(MediumRecord, connection)), medium) != CONNECTION_NONE;
  REAL last_pdf = LOAD(pool, LAST_PDF, slots), chance = (REAL)(1.0f);
  REAL3 vertex = position; /* where the last flight began; direction of arrival for waiting lanes */
  MASK waiting = (MASK)(0);
#endif
  INT hit_primitive = (INT)(-1);
  REAL hit_u = (REAL)(0.0f), hit_v = (REAL)(0.0f);
  int left = 0;
  FlightCell cell = flight_cell(launch->grid, geometry, position);
  Depth below = depth_of(&cell, mean_sigma_t(sigma_t));
  for (int event = 0; event < MEDIUM_EVENTS; ++event) {
    const INT flight_state = medium_state(first_cell, DECISION_FLIGHT, &below, dot3(below.normal, direction));
    const MASK flies = alive;
    REAL u[4];
    draw(&random, 0, u);
    random.event += SELECT_INT(alive, 1, 0);
    REAL flight = -LOG(u[0]) * mean_free_path;
    REAL distance = flight;
    REAL3 there = add3(position, scale3(direction, flight));
    const FlightCell end = flight_cell(launch->grid, geometry, there);
    const MASK test = alive & !flight_is_clear(geometry, &cell, &end, direction, flight);
    MASK meets = (MASK)(0);
    if (ANY(test)) {
      const LaneHits hits =
          trace_lanes(surfaces, position, direction, flight, skip, alive, (skip >= 0) & passed, test);
      meets = test & (hits.primitive.integer >= 0);
      distance = SELECT(meets, hits.distance.real, flight);
      there = select3(meets, make3(hits.x.real, hits.y.real, hits.z.real), there);
      hit_primitive = SELECT_INT(meets, hits.primitive.integer, hit_primitive);
      hit_u = SELECT(meets, hits.u.real, hit_u);
      hit_v = SELECT(meets, hits.v.real, hit_v);
    }
    /* sigma_t 0: an endless flight leaves the scene */
    MASK gone = alive & !meets & (flight > 1e30f);
    MASK scatters = alive & !meets & !gone;
    escaped = escaped | gone;
    arrived = arrived | meets;
#if MEDIUM_LIGHT_SAMPLING
    vertex = select3(meets, position, vertex);
#endif
    position = select3(meets | scatters, there, position);
#if SPECTRAL
    /* Densities over the hero's. A surface that is met a tolerance beyond the flight's end is met with any sigma_t: 1. Else
     * sigma times distance is below 17, and where sigma_t[c] is 1e30 times sigma, the exponential is 0. */
    const REAL drawn = SELECT(distance > flight, 0.0f, distance);
    REAL factor[3];
    UNROLL for (int c = 0; c < 3; ++c)
      factor[c] = EXP((sigma - sigma_t[c]) * drawn) *
                  SELECT(scatters, MIN(sigma_t[c] * mean_free_path, (REAL)(1e30f)), 1.0f);
    spectral_event(meets | scatters, factor, weight);
#endif
    cell = end; /* who met a surface needs none */
    below = depth_of(&cell, mean_sigma_t(sigma_t));
    MediumStep step = no_medium_step(medium_index);
    step_passage(&step, sigma_t, distance, meets);
    step_scattering(&step, sigma_t, albedo, distance, scatters);
    /* weighed as after the flight: then the means are zero over the mixture of the hero channels' densities too */
    REAL total[THROUGHPUT_CHANNELS], change[THROUGHPUT_CHANNELS], future[THROUGHPUT_CHANNELS];
    UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) total[c] = throughput[c] * refraction_scale * weight[c];
    record_visit(launch, job, pool, slots, &random, random.event - 1, DECISION_FLIGHT, flight_state, total, flies);
    add_flight(launch, job, pool, slots, &scores, &baseline, &step, total, flight_state);
    skip = SELECT_INT(scatters, -1, skip);
    depth += SELECT_INT(scatters, 1, 0);
    UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) throughput[c] *= SELECT(scatters, albedo[c], 1.0f);
    const REAL largest = brightest(throughput, weight);
#if OPERATOR_SINGLE
    MASK again = scatters & (depth >= SCATTERED_ONCE);
    dead = dead | again;
    scatters = scatters & !again;
    depth += SELECT_INT(scatters, SCATTERED_ONCE, 0);
#endif
    INT vertices = plain_depth(depth);
    const MASK may_go_on = scatters & (largest > 0.0f) & (vertices < job->max_depth);
    UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) total[c] = throughput[c] * refraction_scale * weight[c];
    MASK dies = roulette(job, vertices, u[3], scatters, largest, throughput);
    MASK goes_on = scatters & !dies;
    dead = dead | dies;
    alive = scatters & !dies;
    const INT turn_state = medium_state(first_cell, DECISION_TURN, &below, dot3(below.normal, direction));
    expected_future(launch, turn_state, future);
    UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) {
      const REAL raised = throughput[c] * refraction_scale * weight[c];
      change[c] = SELECT(may_go_on, SELECT(alive, raised, 0.0f) - total[c], 0.0f);
      total[c] = raised;
    }
    add_roulette(&baseline, change, future, &scores);
    record_visit(launch, job, pool, slots, &random, random.event - 1, DECISION_TURN, turn_state, total, alive);
#if MEDIUM_LIGHT_SAMPLING
    /* u[2] decides on the connection first; what is left of it is uniform again */
    const REAL expected = connection_chance(launch, job, medium, &cell, direction, brightest(throughput, weight),
                                            mean_sigma_t(sigma_t), g);
    chance = SELECT(alive, expected, chance);
    MASK connects = alive & connectable & (u[2] < chance);
    u[2] = SELECT(connectable, SELECT(u[2] < chance, u[2] / chance, (u[2] - chance) / (1.0f - chance)), u[2]);
    vertex = select3(connects, direction, vertex);
    waiting = waiting | connects;
#endif
    REAL cosine, sine, s, c;
    henyey_greenstein_sample(g, u[1], &cosine, &sine);
    sin_cos_2pi(u[2], &s, &c);
    Frame frame = make_frame(direction);
    REAL3 turned = frame_to_world(&frame, make3(sine * c, sine * s, cosine));
    turned = scale3(turned, 1.5f - 0.5f * dot3(turned, turned)); /* stays unit over thousands of turns */
    direction = select3(alive, turned, direction);
#if MEDIUM_LIGHT_SAMPLING
    last_pdf = SELECT(alive, SELECT(connectable, henyey_greenstein(cosine, g) / chance, 0.0f), last_pdf);
    alive = alive & !connects; /* connected before the path goes on, so contributions keep their order */
#endif
    step_phase(&step, cosine, g, goes_on);
    add_turn(job, pool, slots, &scores, &baseline, &step, total, future, alive);
    left = popcount(lane_bits(alive));
    if (left <= enough) break;
  }
  store3(pool, POSITION_X, slots, position);
  store3(pool, DIRECTION_X, slots, direction);
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) STORE(pool, THROUGHPUT + c, slots, throughput[c]);
  store_scores(launch, job, pool, slots, &scores, valid);
  store_baseline(pool, slots, &baseline);
  STORE_INT(pool, EVENT, slots, random.event);
  STORE_INT(pool, DEPTH, slots, depth);
  STORE_INT(pool, SKIP, slots, skip);
  STORE_INT(pool, HIT, slots, hit_primitive);
  STORE(pool, HIT_U, slots, hit_u);
  STORE(pool, HIT_V, slots, hit_v);
#if SPECTRAL
  UNROLL for (int c = 0; c < 3; ++c) STORE(pool, SPECTRAL_WEIGHT + c, slots, weight[c]);
#endif
  finish(launch, job, pool, slots, dead);
  push_surface(launch, job, pool, slots, arrived, hit_primitive);
  push(pool, QUEUE_ESCAPE, slots, escaped);
#if MEDIUM_LIGHT_SAMPLING
  STORE(pool, LAST_PDF, slots, last_pdf);
  STORE(pool, CHANCE, slots, chance);
  store3(pool, ARRIVAL_X, slots, vertex);
  push(pool, QUEUE_CONNECT, slots, waiting);
#endif
  if (left) push(pool, QUEUE_MEDIUM, slots, alive);
}

#endif

#endif
