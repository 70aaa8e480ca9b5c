/* Quiet derivatives. At every decision that a path samples, anything whose mean is zero whatever happened before can be
 * taken off the derivative. With W the path's weight, S its score before the decision and s what the decision adds to the
 * score, that is, for any functions V and A_i of the state before it,
 *   W V s                      the score of the decision's density has mean zero
 *   W S sum_i A_i outcome_i    as have the outcomes below
 * With V near what a path of weight 1 still gathers from there, and A_i near how this grows with the outcome, the
 * derivative's noise falls. Other paths have taught a table of them (runtime/wavefront/baseline.h).
 *
 * decision            state                                       outcomes
 * free flight         depth below the surface, cosine to its normal   u - 1/2
 * phase function      the same                                    Legendre polynomials of the cosine, less their means
 * rough boundary      cosine of arrival                           reflection less its probability
 * kernels/README.md, "Quiet derivatives", says what each is worth. */
#ifndef ITN_BASELINE_H
#define ITN_BASELINE_H
#include "lib/flight_grid.h"
#include "lib/score.h"

/* Sums over the decisions so far of what is to be taken off: [score][throughput channel]. */
typedef struct {
  REAL of[BASELINE_SCORES * THROUGHPUT_CHANNELS + 1];
} Baseline;

inline Baseline load_baseline(const Pool* pool, INT slots) {
  Baseline b;
  UNROLL for (int i = 0; i < BASELINE_SCORES * THROUGHPUT_CHANNELS; ++i) b.of[i] = LOAD(pool, BASELINE + i, slots);
  return b;
}

inline void store_baseline(const Pool* pool, INT slots, const Baseline* b) {
  UNROLL for (int i = 0; i < BASELINE_SCORES * THROUGHPUT_CHANNELS; ++i) STORE(pool, BASELINE + i, slots, b->of[i]);
}

/* Where a path is below the nearest surface. */
typedef struct {
  REAL3 normal; /* of the surface, unit, a guess */
  INT row;      /* of the table, by depth */
} Depth;

inline Depth depth_of(const FlightCell* cell, REAL sigma_t) {
  const REAL scale = 1.0f / SQRT(dot3(cell->normal, cell->normal));
  Depth d;
  d.normal = scale3(cell->normal, scale);
  const REAL depth = MAX(MIN(cell->offset * scale, cell->radius) - dot3(d.normal, cell->from), (REAL)(0.0f)) * sigma_t;
  d.row = min(CAST_INT(depth / (depth + 2.0f) * BASELINE_DEPTHS), (INT)(BASELINE_DEPTHS - 1));
  return d;
}

/* first: of the medium's cells; cosine: between the normal and the direction of travel before the decision */
inline INT medium_state(INT first, int decision, const Depth* depth, REAL cosine) {
  const INT column = min(CAST_INT((1.0f + cosine) * (BASELINE_COSINES / 2)), (INT)(BASELINE_COSINES - 1));
  return first + (decision * BASELINE_DEPTHS + depth->row) * BASELINE_COSINES + max(column, (INT)(0));
}

inline INT boundary_state(INT first, REAL cosine) {
  const INT column = min(CAST_INT((1.0f + cosine) * (BASELINE_BOUNDARY_CELLS / 2)), (INT)(BASELINE_BOUNDARY_CELLS - 1));
  return first + max(column, (INT)(0));
}

/* Under the phase function their means are g and g^2 times their values before: Legendre polynomials are its eigenfunctions. */
inline REAL legendre_2(REAL cosine) { return 1.5f * cosine * cosine - 0.5f; }

/* A number of a state's cell: 0 is V, then the A_i. */
inline REAL cell_number(const Launch* launch, INT state, int channel, int number) {
  return GATHER((launch->futures + channel * BASELINE_NUMBERS + number), state * (THROUGHPUT_CHANNELS * BASELINE_NUMBERS));
}

/* outcome: 0 where there was no decision, as is step. change: W after roulette less W before, which has mean zero too. */
inline void add_decision(const Launch* launch, Baseline* b, INT state, const REAL weight[], const REAL outcome[BASELINE_SLOPES],
                         const REAL change[], const Scores* before, const Scores* step) {
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) {
    const REAL v = cell_number(launch, state, c, 0);
    const REAL future = weight[c] * v;
    const REAL gain = change[c] * v + weight[c] * (cell_number(launch, state, c, 1) * outcome[0] +
                                                   cell_number(launch, state, c, 2) * outcome[1]);
    UNROLL for (int k = 0; k < BASELINE_SCORES; ++k) {
      REAL* sum = b->of + k * THROUGHPUT_CHANNELS + c;
      const int kind = launch->scores[k].kind;
      *sum += gain * before->of[k];
      /* no density depends on a factor alone */
      if (kind != SCORE_ALBEDO && kind != SCORE_REFLECTANCE) *sum += future * step->of[k];
    }
  }
}

/* In a pilot: writes what the host learns the table from. event: of the random numbers, with one visit of each DECISION_*.
 */
inline void record_visit(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                         const Random* random, INT event, int decision, INT state, const REAL weight[],
                         const REAL outcome[BASELINE_SLOPES], MASK mask) {
  if (BASELINE_SCORES == 0 || !job->pilot) return;
  const INT path = (AS_INT(random->pixel) - job->first_pixel) * job->samples + AS_INT(random->sample) - job->first_sample;
  mask = mask & (event < BASELINE_EVENTS);
  Lanes at, value[BASELINE_VISIT_SIZE(THROUGHPUT_CHANNELS, RADIANCE_CHANNELS)];
  int size = 0;
  value[size++].integer = state + 1;
  UNROLL for (int i = 0; i < BASELINE_SLOPES; ++i) value[size++].real = outcome[i];
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) value[size++].real = weight[c];
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c) value[size++].real = LOAD(pool, RADIANCE + c, slots);
  at.integer = ((job->first_output + path) * BASELINE_VISITS + event * DECISIONS + decision) * size;
  const uint bits = lane_bits(mask);
  FOR_EACH_LANE(l, bits) {
    for (int i = 0; i < size; ++i) launch->visits[at.i[l] + i] = value[i].f[l];
  }
}

#endif
