/* The scores that a path carries to differentiate the image by scene parameters (score function, paper section 4):
 * for each ScoreRecord the sum of d log f / d number over the factors f of its throughput so far. Sampling is held
 * fixed. The derivatives of the factors themselves are printed from kernels/model: program/scores.h
 * (runtime/render/derivative). */
#ifndef ITN_SCORE_H
#define ITN_SCORE_H
#include "program/scores.h"
#include "derivative/adjoint.h"
#include "texture/numbers.h"

/* The step that an event adds to the scores of one model's numbers: d log f / d n[slot] in each channel of the
 * throughput: of[slot * CHANNELS + channel]; and the instance, a lane each. */
typedef struct {
  REAL of[MOST_SLOTS * CHANNELS];
  INT first;                 /* n = numbers + first */
  INT origins[ORIGIN_WORDS]; /* of the numbers: texture/numbers.h */
} Step;

INLINE Step no_step(INT first) {
  Step s;
  UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) s.of[i] = (REAL)(0.0f);
  s.first = first;
  UNROLL_FOR(int word = 0; word < ORIGIN_WORDS; ++word) s.origins[word] = (INT)(0);
  return s;
}

/* Adds d to the lanes in `mask`. */
INLINE void add_step(Step* s, const REAL d[], MASK mask) {
  UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) s->of[i] += SELECT(mask, d[i], 0.0f);
}

/* Known when the program is built: scores that are not asked for cost nothing. */
__constant ScoreRecord carried[SCORES + 1] = {SCORE_RECORDS};

/* The part of a model's step that is added to carried[k], one of the model's scores. */
INLINE REAL step_of(__global const JobRecord* job, int k, const Step* step) {
  const ScoreRecord r = carried[k];
  const REAL d = step->of[r.slot * CHANNELS + (CHANNELS == 1 ? 0 : r.channel)];
  return SELECT(step->first - job->first_number == r.first, where_from(step->origins, r.slot, r.origin, d), 0.0f);
}

typedef struct {
  REAL of[SCORES + 1]; /* the last one is not used: an array of length 0 is not C */
#if ADJOINT
  AdjointSums adjoint;
#endif
} Scores;

INLINE Scores no_scores(void) {
  Scores s;
  UNROLL_FOR(int k = 0; k < SCORES; ++k) s.of[k] = (REAL)(0.0f);
  return s;
}

INLINE Scores load_scores(__global const JobRecord* job, const Pool* pool, INT slots) {
  Scores s;
  UNROLL_FOR(int k = 0; k < SCORES; ++k) s.of[k] = LOAD(pool, SCORE + k, slots);
#if ADJOINT
  REAL baseline[BASELINE_TOTALS + 1];
  UNROLL_FOR(int c = 0; c < BASELINE_TOTALS; ++c) baseline[c] = LOAD(pool, BASELINE + c, slots);
  s.adjoint = no_adjoint_sums();
  weigh_by_rest(&s.adjoint, job, pool, slots, baseline);
#endif
  return s;
}

INLINE void store_scores(const Pool* pool, INT slots, const Scores* s) {
  UNROLL_FOR(int k = 0; k < SCORES; ++k) STORE(pool, SCORE + k, slots, s->of[k]);
}

/* Replay: what the lanes in `mask` have added to the numbers of a model since load_scores. uv: as of load_numbers, or
 * null where nothing is textured. */
INLINE void sum_scores(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                       const Scores* s, int model, INT first, const REAL uv[], MASK mask) {
#if ADJOINT
  if (job->replay == REPLAY_SUMS) add_adjoint(launch, job, pool, slots, mask, &s->adjoint, model, first, uv);
#endif
}

/* An event, to the scores. n: the numbers; decided: is it a decision that a path sampled, from whose densities' scores
 * what is expected is taken off? */
INLINE void add_scores(__global const JobRecord* job, Scores* s, int model, const REAL n[], const Step* step,
                       bool decided) {
  UNROLL_FOR(int k = 0; k < SCORES; ++k)
    if (carried[k].model == model) s->of[k] += step_of(job, k, step);
#if ADJOINT
  if (job->replay != REPLAY_SUMS) return;
  UNROLL_FOR(int k = 0; k < SUMS; ++k)
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
      if (!is_summed(k, model, c)) continue;
      const int slot = summed[k].slot;
      const REAL own =
          where_from(step->origins, slot, summed[k].origin, step->of[slot * CHANNELS + (CHANNELS == 1 ? 0 : c)]);
      const REAL d = by_coordinate(model, slot, n, own, summed[k].texels >= 0);
      const bool expects = decided && role_of(model, slot) == ROLE_DENSITY;
      add_product(&s->adjoint, k, c, d, expects ? s->adjoint.weight[c] - s->adjoint.expected[c] : s->adjoint.weight[c]);
    }
#endif
}

/* Compilers cannot unroll, and say so, if many parameters move many numbers each, as values of tables do. */
#if PARTS * RADIANCE_CHANNELS > 768
#define FOR_EACH_PART(p) for (int p = 0; p < PARTS; ++p)
#else
#define FOR_EACH_PART(p) UNROLL_FOR(int p = 0; p < PARTS; ++p)
#endif

#if ALBEDOS
__constant int albedo_score[3] = ALBEDO_SCORE; /* of each channel the score of the medium's albedo */

/* If the medium's albedo is another, a path of n scatterings in it gathers x (other / albedo)^n. Its score is n /
 * albedo, and the job has albedo * log(other / albedo) of each other albedo and channel. */
INLINE void gather_other_albedos(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, int c,
                                 REAL x, const Scores* s) {
  UNROLL_FOR(int k = 0; k < ALBEDOS; ++k) {
    const int field = OTHER_ALBEDO + k * RADIANCE_CHANNELS + c;
    const REAL power = launch->numbers[job->first_exponent + 3 * k + c] * s->of[albedo_score[c]];
    STORE(pool, field, slots, LOAD(pool, field, slots) + x * EXP(power));
  }
}
#endif

/* Adds radiance to the lanes in `mask`, its derivatives, and what it is with other albedos. */
INLINE void gather_radiance(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK mask,
                            const REAL radiance[RADIANCE_CHANNELS], const Scores* s) {
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    const REAL x = SELECT(mask, radiance[c], 0.0f);
    STORE(pool, RADIANCE + c, slots, LOAD(pool, RADIANCE + c, slots) + x);
    FOR_EACH_PART(p) {
      const int field = DERIVATIVE + parts[p].image * RADIANCE_CHANNELS + c;
      if (parts[p].score[c] >= 0)
        STORE(pool, field, slots,
              LOAD(pool, field, slots) + x * launch->derivatives[p].factor[c] * s->of[parts[p].score[c]]);
    }
#if ALBEDOS
    gather_other_albedos(launch, job, pool, slots, c, x, s);
#endif
  }
}

#endif
