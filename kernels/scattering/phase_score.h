/* Changes of direction, to scores, baselines and the sums by voxels: what scattering/phase.h draws. */
#ifndef ITN_PHASE_SCORE_H
#define ITN_PHASE_SCORE_H
#include "derivative/baseline.h"
#include "scattering/phase.h"
#include "derivative/voxel_gradient.h"

/* Lanes in `mask` whose phase function is of that model. */
#define OF_PHASE(name, mask) (PHASE_COUNT == 1 ? (mask) : (mask) & (phase->model == MODEL_##name))

/* The step of a model of the scene, of the lanes in `mask` whose phase function it is. */
#define STEP_OF_PHASE(name, PREFIX, cosine, mask)                              \
  Step step = no_step(phase->first);                                           \
  {                                                                            \
    REAL d[MOST_SLOTS * CHANNELS];                                             \
    UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) d[i] = (REAL)(0.0f); \
    score_##name(phase->n, cosine, d);                                         \
    add_step(&step, d, OF_PHASE(name, mask));                                  \
  }

/* A change of direction, to the scores. */
INLINE void add_phase(__global const JobRecord* job, Scores* scores, const Phase* phase, REAL cosine, MASK mask) {
#define ADD_PHASE(name, PREFIX)                                   \
  {                                                               \
    STEP_OF_PHASE(name, PREFIX, cosine, mask)                     \
    add_scores(job, scores, MODEL_##name, phase->n, &step, true); \
  }
  PHASES_OF_SCENE(ADD_PHASE);
}

/* Replay: a change of direction, to the sums by the voxels of fields that stand for numbers of the phase function.
 * adjoint: that of what comes after it, in each channel of the radiance. A number's score needs no probes: its
 * mean over directions is 0 everywhere, and paths scatter into all directions in which it is not. */
INLINE void sum_phase_by_voxels(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                                const Phase* phase, REAL cosine, MASK mask, const REAL adjoint[]) {
#if VOXEL_SUMS && PHASE_FIELDS
#define SUM_PHASE_BY_VOXELS(name, PREFIX)                                             \
  {                                                                                   \
    STEP_OF_PHASE(name, PREFIX, cosine, mask)                                         \
    for (int k = 0; k < PHASE_FIELDS; ++k) {                                          \
      uint left = lane_bits(OF_PHASE(name, mask) & (phase->fields > k));              \
      while (left) {                                                                  \
        __global const FieldRecord* field;                                            \
        const MASK here = next_field(launch, phase->first_field + k, &left, &field);  \
        if (field->gradient < 0) continue;                                            \
        REAL x[RADIANCE_CHANNELS];                                                    \
        UNROLL_FOR(int slot = 0; slot < MOST_SLOTS; ++slot)                           \
          if (slot == field->slot)                                                    \
            UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)                         \
              x[c] = adjoint[c] * step.of[slot * CHANNELS + (CHANNELS == 1 ? 0 : c)]; \
        add_to_voxels(launch, job, pool, slots, here, field, phase->place, x);        \
      }                                                                               \
    }                                                                                 \
  }
  PHASES_OF_SCENE(SUM_PHASE_BY_VOXELS)
#endif
}

/* One in the event loop, to scores and baselines: see add_scatter. */
INLINE void add_phase_scatter(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                              Scores* scores, Baseline* baseline, const Phase* phase, REAL cosine, const REAL weight[],
                              const REAL future[], MASK scatters, MASK mask) {
  expect_scatter(job, pool, slots, scores, baseline, weight, future, mask);
#define ADD_PHASE_SCATTER(name, PREFIX)                                                      \
  {                                                                                          \
    STEP_OF_PHASE(name, PREFIX, cosine, scatters)                                            \
    add_scatter(job, scores, baseline, MODEL_##name, phase->n, &step, weight, future, mask); \
  }
  PHASES_OF_SCENE(ADD_PHASE_SCATTER)
#if VOXEL_SUMS && PHASE_FIELDS
  if (job->replay != REPLAY_SUMS) return;
  REAL adjoint[RADIANCE_CHANNELS];
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
    adjoint[c] = scores->adjoint.weight[c] - scores->adjoint.expected[c];
  sum_phase_by_voxels(launch, job, pool, slots, phase, cosine, BASELINES ? scatters : mask, adjoint);
#endif
}

/* Replay: to the sums of the numbers. */
INLINE void sum_phase(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                      const Scores* scores, const Phase* phase, MASK mask) {
#define SUM_PHASE(name, PREFIX) \
  sum_scores(launch, job, pool, slots, scores, MODEL_##name, phase->first, 0, OF_PHASE(name, mask));
  PHASES_OF_SCENE(SUM_PHASE)
}

#endif
