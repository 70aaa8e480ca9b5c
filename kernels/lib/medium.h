/* The medium that each lane is in: model/medium/list.h expanded for those that the scene has (MEDIA_OF_SCENE of the
 * program, runtime/compile/surfaces.h). Where it has one, no lane chooses.
 *
 * The event loop (stage/medium.h) and light connections know no more of a medium than this file:
 *   medium_flight        distance to the next scattering, surfaces aside
 *   weigh_medium_flight  spectral weights after it (lib/launch.h)
 *   medium_thickness     what its scores are by: the length that counts of a way, distance where a medium is the same
 *                        everywhere
 *   add_medium_flight, add_passage, sum_medium   to scores and baselines
 *   typical_sigma_t      for choices that are right with any value */
#ifndef ITN_MEDIUM_LANES_H
#define ITN_MEDIUM_LANES_H
#include "lib/baseline.h"

/* Extinction and albedo are the first numbers of every medium. */
enum {
  MEDIUM_sigma_t = HOMOGENEOUS_sigma_t,
  MEDIUM_sigma_t_last = HOMOGENEOUS_sigma_t_last,
  MEDIUM_albedo = HOMOGENEOUS_albedo
};

typedef struct {
  INT model, first; /* n = numbers + first */
  REAL n[MOST_SLOTS];
} Medium;

/* Lanes in `mask` whose medium is of that model. */
#define IN_MEDIUM(name, mask) (MEDIUM_COUNT == 1 ? (mask) : (mask) & (medium->model == MODEL_##name))

inline Medium load_medium(const Launch* launch, INT index) {
  const INT at = index * (int)(sizeof(MediumRecord) / sizeof(int));
  __global const int* media = (__global const int*)launch->media;
  const REAL nowhere[2] = {(REAL)(0.0f), (REAL)(0.0f)};
  Medium m;
  m.model = MEDIUM_COUNT == 1 ? (INT)(0) : GATHER_INT((media + FIELD_OF(MediumRecord, model)), at);
  m.first = GATHER_INT((media + FIELD_OF(MediumRecord, first_number)), at);
  UNROLL_FOR(int i = 0; i < MOST_SLOTS; ++i) m.n[i] = (REAL)(0.0f);
    /* what a lane of another model reads is not used */
#define LOAD_MEDIUM(name, PREFIX) load_numbers(launch, MODEL_##name, m.first, nowhere, m.n);
  MEDIA_OF_SCENE(LOAD_MEDIUM)
  return m;
}

/* The same whatever the path's hero channel. */
inline REAL typical_sigma_t(const Medium* medium) { return mean_sigma_t(medium->n + MEDIUM_sigma_t); }

/* Distance to the next scattering. sigma_t: of the hero channel */
inline REAL medium_flight(REAL u, REAL mean_free_path) { return -LOG(u) * mean_free_path; }

#if SPECTRAL
/* The flight's density with each channel's sigma_t over that with the hero's. distance: up to where the path got.
 * A surface that is met a tolerance beyond the flight's end is met with any sigma_t: 1. Else sigma times distance is below
 * 17, and where sigma_t[c] is 1e30 times sigma, the exponential is 0. */
inline void weigh_medium_flight(const Medium* medium, REAL sigma, REAL mean_free_path, REAL flight, REAL distance,
                                MASK meets, MASK scatters, REAL weight[3]) {
  const REAL* sigma_t = medium->n + MEDIUM_sigma_t;
  const REAL drawn = SELECT(distance > flight, 0.0f, distance);
  REAL factor[3];
  UNROLL_FOR(int c = 0; c < 3; ++c)
    factor[c] = EXP((sigma - sigma_t[c]) * drawn) *
                SELECT(scatters, MIN(sigma_t[c] * mean_free_path, (REAL)(1e30f)), 1.0f);
  spectral_event(meets | scatters, factor, weight);
}
#endif

/* What a way of that thickness adds to the scores of a medium, of the lanes whose medium is of the model: `meets`: it reaches
 * a surface or a light, `scatters`: it ends in a scattering. */
#define ADD_WAY(event, mask)                                                       \
  {                                                                                \
    REAL d[MOST_SLOTS * CHANNELS];                                                 \
    UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) d[i] = (REAL)(0.0f);     \
    event(medium->n, thickness, d);                                                \
    add_step(&step, d, mask);                                                      \
  }

/* A flight, to the scores and to the baseline: see add_flight. */
inline void add_medium_flight(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                              Scores* scores, Baseline* baseline, const Medium* medium, REAL thickness, MASK meets,
                              MASK scatters, const REAL weight[], INT state) {
#define ADD_MEDIUM_FLIGHT(name, PREFIX)                                                                             \
  {                                                                                                                 \
    Step step = no_step(medium->first);                                                                             \
    ADD_WAY(score_##name##_passage, IN_MEDIUM(name, meets))                                                         \
    ADD_WAY(score_##name##_scattering, IN_MEDIUM(name, scatters))                                                   \
    add_flight(launch, job, pool, slots, scores, baseline, MODEL_##name, medium->n, &step, weight, state);          \
  }
  MEDIA_OF_SCENE(ADD_MEDIUM_FLIGHT)
}

/* A passage of a connection, to the scores. */
inline void add_passage(__global const JobRecord* job, Scores* scores, const Medium* medium, REAL thickness, MASK mask) {
#define ADD_PASSAGE(name, PREFIX)                                  \
  {                                                                \
    Step step = no_step(medium->first);                            \
    ADD_WAY(score_##name##_passage, IN_MEDIUM(name, mask))         \
    add_scores(job, scores, MODEL_##name, medium->n, &step, true); \
  }
  MEDIA_OF_SCENE(ADD_PASSAGE)
}

/* Replay: to the sums of the numbers. */
inline void sum_medium(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                       const Scores* scores, const Medium* medium, MASK mask) {
#define SUM_MEDIUM(name, PREFIX) \
  sum_scores(launch, job, pool, slots, scores, MODEL_##name, medium->first, IN_MEDIUM(name, mask));
  MEDIA_OF_SCENE(SUM_MEDIUM)
}

/* Is carried[k] a score by sigma_t of a medium? */
inline bool is_of_extinction(int k) {
  bool is = false;
#define IS_OF_MEDIUM(name, PREFIX) is = is || carried[k].model == MODEL_##name;
  MEDIA_OF_SCENE(IS_OF_MEDIUM)
  return is && carried[k].slot <= MEDIUM_sigma_t_last;
}

/* What a passage adds to carried[k], which is one: the same whatever sigma_t is. */
inline REAL score_of_passage(int k, REAL thickness) {
  REAL d[MOST_SLOTS * CHANNELS], ones[MOST_SLOTS];
  UNROLL_FOR(int i = 0; i < MOST_SLOTS; ++i) ones[i] = (REAL)(1.0f);
#define SCORE_OF_PASSAGE(name, PREFIX) \
  if (carried[k].model == MODEL_##name) score_##name##_passage(ones, thickness, d);
  MEDIA_OF_SCENE(SCORE_OF_PASSAGE)
  return d[carried[k].slot * CHANNELS + (CHANNELS == 1 ? 0 : carried[k].channel)];
}

#endif
