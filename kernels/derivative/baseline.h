/* Quiet derivatives. At every decision that a path samples, anything whose mean is zero whatever happened before can be
 * taken off the derivative. With V any function of the path's state that is:
 *   a free flight, the phase function, a rough boundary's normal and lobe:
 *                weight * V * score of the decision's density
 *   roulette:    (weight after - weight before) * V * score of the path so far
 * With V near what a path of weight 1 still gathers, the derivative's noise falls. V is a table that other paths have
 * taught (runtime/render/wavefront/baseline.h): in a medium by depth below the surface and cosine to its normal, at a rough
 * boundary by the cosine of arrival. kernels/README.md, "Quiet derivatives".
 *
 * Gradients by replay (derivative/adjoint.h) take the same off, turned round: an event's score meets all of roulette's terms
 * after it, as it meets all that is gathered after it, so that paths carry the sum of (weight after - weight before) *
 * V alone. */
#ifndef ITN_BASELINE_H
#define ITN_BASELINE_H
#include "path/event_random.h"
#include "geometry/flight_grid.h"
#include "derivative/score.h"

#define BASELINE_SCORES (BASELINES ? SCORES + ADJOINT : 0)

/* Sums over the path's decisions so far: [score][throughput channel]; if ADJOINT over roulettes alone, for a score of
 * 1. They go beside the derivatives until the path's end: how many decisions a stage makes at a time depends on the
 * schedule, and must not change the order of additions. */
typedef struct {
  REAL of[BASELINE_SCORES * THROUGHPUT_CHANNELS + 1];
} Baseline;

INLINE Baseline load_baseline(const Pool* pool, INT slots) {
  Baseline b;
  UNROLL_FOR(int i = 0; i < BASELINE_SCORES * THROUGHPUT_CHANNELS; ++i) b.of[i] = LOAD(pool, BASELINE + i, slots);
  return b;
}

INLINE void store_baseline(const Pool* pool, INT slots, const Baseline* b) {
  UNROLL_FOR(int i = 0; i < BASELINE_SCORES * THROUGHPUT_CHANNELS; ++i) STORE(pool, BASELINE + i, slots, b->of[i]);
}

/* The place of a path below the nearest surface. */
typedef struct {
  REAL3 normal; /* of the surface, unit, a guess */
  INT row;      /* of the table, by depth */
} Depth;

INLINE Depth depth_of(const FlightCell* cell, REAL sigma_t) {
  const REAL square = dot3(cell->normal, cell->normal);               /* 1/3 to 1 */
  const REAL scale = 2.4495f + square * (1.1547f * square - 2.6042f); /* 1 / sqrt to 1.5 % */
  Depth d;
  d.normal = scale3(cell->normal, scale);
  const REAL depth = MAX(MIN(cell->offset * scale, cell->radius) - dot3(d.normal, cell->from), (REAL)(0.0f)) * sigma_t;
  /* four rows an octave of 1 + 4 depth: the exponent and two bits of the mantissa */
  d.row = min((AS_INT(1.0f + 4.0f * depth) - 0x3f800000) >> 21, (INT)(BASELINE_DEPTHS - 1));
  return d;
}

/* first: of the medium's cells; cosine: between the normal and the direction of travel before the decision */
INLINE INT medium_state(INT first, int decision, const Depth* depth, REAL cosine) {
  const INT column = min(CAST_INT((1.0f + cosine) * (BASELINE_COSINES / 2)), (INT)(BASELINE_COSINES - 1));
  return first + (decision * BASELINE_DEPTHS + depth->row) * BASELINE_COSINES + max(column, (INT)(0));
}

INLINE INT boundary_state(INT first, REAL cosine) {
  const INT column = min(CAST_INT((1.0f + cosine) * (BASELINE_BOUNDARY_CELLS / 2)), (INT)(BASELINE_BOUNDARY_CELLS - 1));
  return first + max(column, (INT)(0));
}

/* V, a channel each; 0 where there is no table. */
__attribute__((always_inline)) INLINE void expected_future(const Launch* launch, INT state, REAL v[]) {
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c)
    v[c] = BASELINES ? GATHER((launch->futures + c), state * THROUGHPUT_CHANNELS) : (REAL)(0.0f);
}

#if ADJOINT
/* Sets what a decision's score meets. weight: throughput with all its factors */
INLINE void expect(AdjointSums* p, __global const JobRecord* job, const Pool* pool, INT slots, const Baseline* b,
                   const REAL weight[], const REAL v[]) {
  if (job->replay != REPLAY_SUMS) return;
  weigh_by_rest(p, job, pool, slots, b->of);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    const int t = THROUGHPUT_CHANNELS == 1 ? 0 : c;
    p->expected[c] = LOAD(pool, PIXEL_ADJOINT + c, slots) * job->future_tint[c] * weight[t] * v[t];
  }
}
#else
/* step: what the decision adds to the scores of the model's numbers; no density depends on a factor alone. */
INLINE void add_decision(__global const JobRecord* job, Baseline* b, int model, const REAL weight[], const REAL v[],
                         const Step* step) {
  UNROLL_FOR(int k = 0; k < BASELINE_SCORES; ++k) {
    if (carried[k].model != model || role_of(model, carried[k].slot) != ROLE_DENSITY) continue;
    const REAL d = step_of(job, k, step);
    UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) b->of[k * THROUGHPUT_CHANNELS + c] += weight[c] * v[c] * d;
  }
}
#endif

/* A flight, to the scores and to the baseline. weight: throughput with all its factors; state: before the flight */
INLINE void add_flight(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, Scores* scores,
                       Baseline* b, int model, const REAL n[], const Step* step, const REAL weight[], INT state) {
#if BASELINES
  REAL v[THROUGHPUT_CHANNELS];
  expected_future(launch, state, v);
#if ADJOINT
  expect(&scores->adjoint, job, pool, slots, b, weight, v);
#else
  add_decision(job, b, model, weight, v, step);
#endif
#endif
  add_scores(job, scores, model, n, step, true);
}

/* Before the changes of direction of an event are added by add_scatter: what is expected of them. Lanes not in `mask`
 * meet their scores later: they connect with light first (stage/connect.h). */
INLINE void expect_scatter(__global const JobRecord* job, const Pool* pool, INT slots, Scores* scores,
                           const Baseline* b, const REAL weight[], const REAL v[], MASK mask) {
#if BASELINES && ADJOINT
  expect(&scores->adjoint, job, pool, slots, b, weight, v);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
    scores->adjoint.weight[c] = SELECT(mask, scores->adjoint.weight[c], 0.0f);
#endif
}

/* A change of direction by one of the phase functions. */
INLINE void add_scatter(__global const JobRecord* job, Scores* scores, Baseline* b, int model, const REAL n[],
                        Step* step, const REAL weight[], const REAL v[], MASK mask) {
#if !(BASELINES && ADJOINT)
#if BASELINES
  add_decision(job, b, model, weight, v, step);
#endif
  UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) step->of[i] = SELECT(mask, step->of[i], 0.0f);
#endif
  add_scores(job, scores, model, n, step, true);
}

/* Adds what a surface's BSDF has decided to the baseline. step: of the decision's density */
INLINE void add_lobe(__global const JobRecord* job, const Pool* pool, INT slots, Scores* scores, int model,
                     const REAL n[], const Step* step, const REAL weight[], const REAL v[]) {
#if BASELINES
  Baseline b = load_baseline(pool, slots);
#if ADJOINT
  expect(&scores->adjoint, job, pool, slots, &b, weight, v);
  if (job->replay != REPLAY_SUMS) return;
  UNROLL_FOR(int k = 0; k < SUMS; ++k)
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
      const int slot = summed[k].slot;
      if (!is_summed(k, model, c) || role_of(model, slot) != ROLE_DENSITY) continue;
      const REAL own =
          where_from(step->origins, slot, summed[k].origin, step->of[slot * CHANNELS + (CHANNELS == 1 ? 0 : c)]);
      const REAL d = by_coordinate(model, slot, n, own, summed[k].texels >= 0);
      add_product(&scores->adjoint, k, c, d, -scores->adjoint.expected[c]);
    }
#else
  add_decision(job, &b, model, weight, v, step);
  store_baseline(pool, slots, &b);
#endif
#endif
}

/* change: of the weight, 0 where no roulette was played */
INLINE void add_roulette(Baseline* b, const REAL change[], const REAL v[], const Scores* scores) {
  UNROLL_FOR(int k = 0; k < BASELINE_SCORES; ++k)
    UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c)
      b->of[k * THROUGHPUT_CHANNELS + c] += change[c] * v[c] * (ADJOINT ? (REAL)(1.0f) : scores->of[k]);
}

/* In a pilot: writes what the host learns the table from. event: of the random numbers, with one visit of each
 * DECISION_*.
 */
INLINE void record_visit(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                         const Random* random, INT event, int decision, INT state, const REAL weight[], MASK mask) {
  if (!BASELINES || !job->pilot) return;
  const INT path = (AS_INT(random->pixel) - job->first_pixel) / job->pixel_step * job->samples +
                   AS_INT(random->sample) - job->first_sample;
  mask = mask & (event < BASELINE_EVENTS);
  Lanes at, value[BASELINE_VISIT_SIZE(THROUGHPUT_CHANNELS, RADIANCE_CHANNELS)];
  int size = 0;
  value[size++].integer = state + 1;
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) value[size++].real = weight[c];
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) value[size++].real = LOAD(pool, RADIANCE + c, slots);
  at.integer = ((job->first_output + path) * BASELINE_VISITS + event * DECISIONS + decision) * size;
  const uint bits = lane_bits(mask);
  FOR_EACH_LANE(l, bits) {
    for (int i = 0; i < size; ++i) launch->visits[at.i[l] + i] = value[i].f[l];
  }
}

#endif
