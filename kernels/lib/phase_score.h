/* Changes of direction, to scores and baselines: what lib/phase.h draws. */
#ifndef ITN_PHASE_SCORE_H
#define ITN_PHASE_SCORE_H
#include "lib/baseline.h"
#include "lib/phase.h"

/* The step of a model of the scene, of the lanes in `mask` whose phase function it is. */
#define STEP_OF_PHASE(name, PREFIX, cosine, mask)                                            \
  Step step = no_step(phase->first);                                                         \
  {                                                                                          \
    REAL d[MOST_SLOTS * CHANNELS];                                                           \
    UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) d[i] = (REAL)(0.0f);               \
    score_##name(phase->n, cosine, d);                                                       \
    add_step(&step, d, PHASE_COUNT == 1 ? (mask) : (mask) & (phase->model == MODEL_##name)); \
  }

/* A change of direction, to the scores. */
inline void add_phase(__global const JobRecord* job, Scores* scores, const Phase* phase, REAL cosine, MASK mask) {
#define ADD_PHASE(name, PREFIX)                                   \
  {                                                               \
    STEP_OF_PHASE(name, PREFIX, cosine, mask)                     \
    add_scores(job, scores, MODEL_##name, phase->n, &step, true); \
  }
  PHASES_OF_SCENE(ADD_PHASE)
}

/* One in the event loop, to scores and baselines: see add_turn. */
inline void add_phase_turn(__global const JobRecord* job, const Pool* pool, INT slots, Scores* scores,
                           Baseline* baseline, const Phase* phase, REAL cosine, const REAL weight[],
                           const REAL future[], MASK turns, MASK mask) {
  expect_turn(job, pool, slots, scores, baseline, weight, future, mask);
#define ADD_PHASE_TURN(name, PREFIX)                                                      \
  {                                                                                       \
    STEP_OF_PHASE(name, PREFIX, cosine, turns)                                            \
    add_turn(job, scores, baseline, MODEL_##name, phase->n, &step, weight, future, mask); \
  }
  PHASES_OF_SCENE(ADD_PHASE_TURN)
}

/* Replay: to the sums of the numbers. */
inline void sum_phase(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                      const Scores* scores, const Phase* phase, MASK mask) {
#define SUM_PHASE(name, PREFIX)                                               \
  sum_scores(launch, job, pool, slots, scores, MODEL_##name, phase->first, 0, \
             PHASE_COUNT == 1 ? mask : mask & (phase->model == MODEL_##name));
  PHASES_OF_SCENE(SUM_PHASE)
}

#endif
