/* Probes: the part of gradients by voxels (derivative/voxel_gradient.h) that scatterings of paths cannot tell, since paths
 * scatter seldom or never where a field is small or 0. Paths are traced PROBES more times. Each has, from the first time, the
 * sum over its flights of throughput times "room", the length of those parts of a flight that may need a probe. In proportion
 * to it one flight is chosen each time, and ends at a place that is chosen in proportion to the room: there the path
 * scatters, whatever the field is, and goes on by other random numbers. That the flight got there is the transmittance. What
 * it then gathers, times
 *   (1 - value / knee) * sum / throughput
 * is on average what all its flights would scatter to it for a unit of extinction there.
 *
 * What baselines (derivative/baseline.h) expect of a scattering is taken off here too: with the scores of scatterings alone the
 * mean of a flight's score is not 0.
 *
 * Of an albedo it is a scattering that becomes a probe, in proportion to throughput times 1 - albedo / knee, and goes on
 * with that lack in place of the albedo: what it then gathers, times sum / (throughput * largest lack of a channel). */
#ifndef ITN_PROBE_H
#define ITN_PROBE_H
#include "path/event_random.h"
#include "path/spectral.h"
#include "scattering/medium.h"

#if VOXEL_SUMS
enum { STREAM_PROBE = 0x80 };
#define PROBED_EVENTS 0x1000000 /* events after the probe: random numbers that the path had not drawn */

/* The room on a way. Where what was passed of it reaches `target` is *at. */
INLINE REAL room_on_way(const Launch* launch, __global const FieldRecord* field, REAL sigma_t, REAL3 from,
                        REAL3 direction, REAL distance, MASK mask, REAL target, REAL* at) {
  const REAL knee = knee_of(field, sigma_t);
  Way w = enter_field(launch, field, from, direction, distance, mask);
  REAL room = (REAL)(0.0f);
  MASK looks = mask;
  while (ANY(w.inside)) {
    const REAL length = end_of_cell(&w) - w.at, before = room;
    room += SELECT(w.inside & (w.least < knee), length, 0.0f);
    const MASK reached = looks & w.inside & (room > before) & (room >= target);
    *at = SELECT(reached, w.at + MIN(MAX(target - before, (REAL)(0.0f)), length), *at);
    looks = looks & !reached;
    next_cell(launch, field, direction, w.inside, &w);
  }
  return room;
}

/* The state of a path's probe. */
typedef struct {
  REAL passed; /* sum over the flights so far */
  REAL target; /* the flight that reaches it becomes the probe; infinite: none will */
} ProbeState;

/* A flight that becomes a probe. */
typedef struct {
  MASK flies;
  REAL distance, throughput;
} Probe;

INLINE ProbeState load_probe_state(const Pool* pool, INT slots) {
  ProbeState s;
  s.passed = LOAD(pool, PROBE_PASSED, slots);
  s.target = LOAD(pool, PROBE_TARGET, slots);
  return s;
}

INLINE void store_probe_state(const Pool* pool, INT slots, const ProbeState* s) {
  STORE(pool, PROBE_PASSED, slots, s->passed);
  STORE(pool, PROBE_TARGET, slots, s->target);
}

/* Chooses the probe of a flight over `distance`. throughput: before it. The event of lanes that become probes is
 * another from here on. */
INLINE Probe choose_probe(const Launch* launch, __global const JobRecord* job, const Medium* medium, Random* random,
                          ProbeState* s, REAL3 from, REAL3 direction, REAL distance, REAL throughput, MASK mask) {
  Probe p;
  p.flies = (MASK)(0);
  p.distance = distance;
  p.throughput = throughput;
  if (job->replay == REPLAY_SUMS) return p;
  const REAL sigma_t = mean_sigma_t(medium->n + MEDIUM_sigma_t);
  if (job->replay == REPLAY_PROBES) mask = mask & (s->target < INFINITY);
  uint left = lane_bits(mask & (medium->field >= 0) & (throughput > 0.0f));
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, medium->field, &left, &field);
    if (field->gradient < 0) continue;
    REAL at = distance;
    const REAL room = room_on_way(launch, field, sigma_t, from, direction, distance, here, (REAL)(INFINITY), &at);
    s->passed += SELECT(here, throughput * room, 0.0f);
    if (job->replay != REPLAY_PROBES) continue;
    const MASK chosen = here & (room > 0.0f) & (s->passed >= s->target);
    if (!ANY(chosen)) continue;
    random->event += SELECT_INT(chosen, PROBED_EVENTS * (1 + job->probe), 0);
    REAL u[4];
    draw(random, STREAM_PROBE, u);
    room_on_way(launch, field, sigma_t, from, direction, distance, chosen, u[0] * room, &at);
    p.flies = p.flies | chosen;
    p.distance = SELECT(chosen, at, p.distance);
    s->target = SELECT(chosen, (REAL)(INFINITY), s->target);
  }
  return p;
}

/* Probes that have got to their places. expected: of the scattering, in each channel of the radiance. Returns who tells
 * something. */
INLINE MASK land_probe(const Launch* launch, Pool* pool, INT slots, const Medium* medium, const Probe* p, REAL3 place,
                       MASK mask, const REAL expected[RADIANCE_CHANNELS]) {
  MASK tells = (MASK)(0);
  uint left = lane_bits(mask);
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, medium->field, &left, &field);
    REAL value[FIELD_CHANNELS];
    field_value(launch, field, place, FIELD_CHANNELS, value);
    const REAL knee = knee_of(field, mean_sigma_t(medium->n + MEDIUM_sigma_t));
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
      const int t = THROUGHPUT_CHANNELS == 1 ? 0 : c;
      const REAL lack = MAX(1.0f - value[FIELD_CHANNELS == 3 ? c : 0] / knee, (REAL)(0.0f));
      REAL weight = LOAD(pool, PROBE_WEIGHT + c, slots);
      weight = SELECT(here, weight * lack * medium->n[MEDIUM_sigma_t + t] / p->throughput, weight);
      STORE(pool, PROBE_WEIGHT + c, slots, weight);
      tells = tells | (here & (weight != 0.0f));
      STORE(pool, RADIANCE + c, slots, SELECT(here, -expected[c], LOAD(pool, RADIANCE + c, slots)));
    }
  }
  const REAL3 old = load3(pool, PROBE_PLACE, slots);
  store3(pool, PROBE_PLACE, slots, select3(mask, place, old));
  STORE_INT(pool, PROBE_FIELD, slots, SELECT_INT(mask, medium->field, LOAD_INT(pool, PROBE_FIELD, slots)));
  return tells;
}

/* At a scattering: in probes what the albedo lacks takes its place. */
INLINE void choose_albedo_probe(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots,
                                const Medium* medium, Random* random, ProbeState* s, REAL3 place, REAL throughput,
                                MASK mask, REAL albedo[THROUGHPUT_CHANNELS]) {
  if (job->replay == REPLAY_SUMS) return;
  if (job->replay == REPLAY_PROBES) mask = mask & (s->target < INFINITY);
  REAL lack[THROUGHPUT_CHANNELS], largest = (REAL)(0.0f);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) {
    lack[c] = MAX(1.0f - albedo[c] / ALBEDO_KNEE, (REAL)(0.0f));
    largest = MAX(largest, lack[c]);
  }
  const REAL part = throughput * largest;
  uint left = lane_bits(mask & (medium->albedo_field >= 0) & (part > 0.0f));
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, medium->albedo_field, &left, &field);
    if (field->gradient < 0) continue;
    s->passed += SELECT(here, part, 0.0f);
    if (job->replay != REPLAY_PROBES) continue;
    const MASK chosen = here & (s->passed >= s->target);
    if (!ANY(chosen)) continue;
    random->event += SELECT_INT(chosen, PROBED_EVENTS * (1 + job->probe), 0);
    s->target = SELECT(chosen, (REAL)(INFINITY), s->target);
    UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) albedo[c] = SELECT(chosen, lack[c], albedo[c]);
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
      const REAL weight = LOAD(pool, PROBE_WEIGHT + c, slots);
      STORE(pool, PROBE_WEIGHT + c, slots, SELECT(chosen, weight / part, weight));
      STORE(pool, RADIANCE + c, slots, SELECT(chosen, 0.0f, LOAD(pool, RADIANCE + c, slots)));
    }
    store3(pool, PROBE_PLACE, slots, select3(chosen, place, load3(pool, PROBE_PLACE, slots)));
    STORE_INT(pool, PROBE_FIELD, slots, SELECT_INT(chosen, medium->albedo_field, LOAD_INT(pool, PROBE_FIELD, slots)));
  }
}

/* A probe's path is complete. */
INLINE void finish_probe(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, MASK mask) {
  const INT of = LOAD_INT(pool, PROBE_FIELD, slots);
  uint left = lane_bits(mask & (of >= 0));
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, of, &left, &field);
    REAL x[RADIANCE_CHANNELS];
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
      x[c] = LOAD(pool, PROBE_WEIGHT + c, slots) * LOAD(pool, RADIANCE + c, slots);
    add_to_voxels(launch, job, pool, slots, here, field, load3(pool, PROBE_PLACE, slots), x);
  }
}
#endif

#endif
