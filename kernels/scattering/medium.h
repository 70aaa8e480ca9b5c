/* The medium that each lane is in: model/medium/list.h expanded for those that the scene has (MEDIA_OF_SCENE of the
 * program, runtime/render/compile/surfaces.h). Where it has one, no lane chooses.
 *
 * The event loop (stage/medium.h) and light connections know no more of a medium than this file:
 *   medium_flight        distance to the next scattering, surfaces aside
 *   weigh_medium_flight  spectral weights after it (path/launch.h)
 *   medium_albedo        at a scattering
 *   segment_transmittance   of a way of a connection
 *   segment_column_density  what scores of a way are by: distance, where a medium is the same everywhere; times sigma_t
 *                           it is the optical depth
 *   add_medium_flight, add_passage, sum_medium   to scores and baselines
 *   sum_way_by_voxels, sum_scattering_by_voxels, sum_albedo_by_voxels  to the sums by the voxels of a field
 *                                                (derivative/voxel_gradient.h)
 *   typical_sigma_t      for choices that are right with any value
 * A medium is its numbers, and the field (texture/field.h) that these are times. */
#ifndef ITN_MEDIUM_LANES_H
#define ITN_MEDIUM_LANES_H
#include "path/event_random.h"
#include "path/spectral.h"
#include "derivative/baseline.h"
#include "texture/field.h"
#include "derivative/voxel_gradient.h"

/* Extinction and albedo are the first numbers of every medium. */
enum {
  MEDIUM_sigma_t = HOMOGENEOUS_sigma_t,
  MEDIUM_sigma_t_last = HOMOGENEOUS_sigma_t_last,
  MEDIUM_albedo = HOMOGENEOUS_albedo
};

typedef struct {
  INT model, first; /* n = numbers + first */
  REAL n[MOST_SLOTS];
#if HAS_FIELDS
  INT field, albedo_field; /* what sigma_t and albedo are times, -1: the same everywhere */
  REAL mean;               /* of the field */
#endif
} Medium;

/* Lanes in `mask` whose medium is of that model. */
#define IN_MEDIUM(name, mask) (MEDIUM_COUNT == 1 ? (mask) : (mask) & (medium->model == MODEL_##name))

INLINE Medium load_medium(const Launch* launch, INT index) {
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
#if HAS_FIELDS
  m.field = GATHER_INT((media + FIELD_OF(MediumRecord, field)), at);
  m.albedo_field = GATHER_INT((media + FIELD_OF(MediumRecord, albedo_field)), at);
  const REAL mean = GATHER(((__global const float*)launch->fields + FIELD_OF(FieldRecord, mean)),
                           max(m.field, (INT)(0)) * (int)(sizeof(FieldRecord) / sizeof(float)));
  m.mean = SELECT(m.field >= 0, mean, 1.0f);
#endif
  return m;
}

/* The same whatever the path's hero channel. */
INLINE REAL typical_sigma_t(const Medium* medium) {
#if HAS_FIELDS
  return mean_sigma_t(medium->n + MEDIUM_sigma_t) * medium->mean;
#else
  return mean_sigma_t(medium->n + MEDIUM_sigma_t);
#endif
}

/* The albedo at a place, a throughput channel each. */
INLINE void medium_albedo(const Launch* launch, const Medium* medium, REAL3 place, MASK mask, REAL albedo[]) {
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) albedo[c] = medium->n[MEDIUM_albedo + c];
#if HAS_FIELDS
  uint left = lane_bits(mask & (medium->albedo_field >= 0));
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, medium->albedo_field, &left, &field);
    REAL value[THROUGHPUT_CHANNELS];
    field_value(launch, field, place, THROUGHPUT_CHANNELS, value);
    UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) albedo[c] *= SELECT(here, value[c], 1.0f);
  }
#endif
}

typedef struct {
  REAL distance; /* to the next scattering, surfaces aside */
#if HAS_FIELDS
  REAL weight[3];             /* spectral, after null collisions up to there */
  REAL there[FIELD_CHANNELS]; /* the field there */
#endif
} Flight;

/* u: uniform; sigma_t of the hero channel is one over the mean free path. random: of the event; weight: before it */
INLINE Flight medium_flight(const Launch* launch, const Medium* medium, const Random* random, REAL u, REAL3 from,
                            REAL3 direction, INT hero, REAL mean_free_path, const REAL weight[3], MASK mask) {
  Flight f;
  f.distance = -LOG(u) * mean_free_path;
#if HAS_FIELDS
  UNROLL_FOR(int c = 0; c < 3; ++c) f.weight[c] = weight[c];
  UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c) f.there[c] = (REAL)(1.0f);
  uint left = lane_bits(mask & (medium->field >= 0));
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, medium->field, &left, &field);
    REAL there[FIELD_CHANNELS];
    const REAL distance = field_flight(launch, field, random, from, direction, (REAL)(ENDLESS),
                                       medium->n + MEDIUM_sigma_t, hero, here, f.weight, there);
    f.distance = SELECT(here, distance, f.distance);
    UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c) f.there[c] = SELECT(here, there[c], f.there[c]);
  }
#endif
  return f;
}

#if SPECTRAL
/* Spectral weights after a flight that got up to `distance`: its density with each channel's sigma_t over that with the
 * hero's. A surface that is met a tolerance beyond the flight's end is met with any sigma_t: 1. Else sigma times distance is
 * below 17, and where sigma_t[c] is 1e30 times sigma, the exponential is 0. In a field the densities are those of its null
 * collisions; where a surface was met, those before it. */
INLINE void weigh_medium_flight(const Launch* launch, const Medium* medium, const Random* random, REAL3 from,
                                REAL3 direction, INT hero, REAL mean_free_path, const Flight* flight, REAL distance,
                                MASK meets, MASK scatters, REAL weight[3]) {
  const REAL* sigma_t = medium->n + MEDIUM_sigma_t;
  const REAL drawn = SELECT(distance > flight->distance, 0.0f, distance);
  const REAL sigma = of_hero(sigma_t, hero);
  REAL factor[3];
  UNROLL_FOR(int c = 0; c < 3; ++c)
    factor[c] =
        EXP((sigma - sigma_t[c]) * drawn) * SELECT(scatters, MIN(sigma_t[c] * mean_free_path, (REAL)(1e30f)), 1.0f);
#if HAS_FIELDS
  const MASK in_field = medium->field >= 0;
  UNROLL_FOR(int c = 0; c < 3; ++c) {
    factor[c] = SELECT(in_field, sigma_t[c] * flight->there[FIELD_CHANNELS == 3 ? c : 0], factor[c]);
    weight[c] = SELECT(in_field & scatters, flight->weight[c], weight[c]);
  }
  spectral_event((meets & !in_field) | scatters, factor, weight);
  uint left = lane_bits(meets & in_field);
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, medium->field, &left, &field);
    REAL there[FIELD_CHANNELS];
    field_flight(launch, field, random, from, direction, distance, sigma_t, hero, here, weight, there);
  }
#else
  spectral_event(meets | scatters, factor, weight);
#endif
}
#endif

/* Does anything that is asked for depend on the sigma_t of a medium? */
INLINE bool is_of_medium(int model) {
  bool is = false;
#define IS_OF_MEDIUM(name, PREFIX) is = is || model == MODEL_##name;
  MEDIA_OF_SCENE(IS_OF_MEDIUM)
  return is;
}
/* Is carried[k] a score by sigma_t of a medium? */
INLINE bool is_of_extinction(int k) { return is_of_medium(carried[k].model) && carried[k].slot <= MEDIUM_sigma_t_last; }
INLINE bool extinction_is_scored(void) {
  UNROLL_FOR(int k = 0; k < SCORES; ++k)
    if (is_of_extinction(k)) return true;
#if ADJOINT
  UNROLL_FOR(int k = 0; k < SUMS; ++k)
    if (is_of_medium(summed[k].model) && summed[k].slot <= MEDIUM_sigma_t_last) return true;
#endif
  return false;
}

/* The length of a way that counts for scores by sigma_t: distance times the field on it, an estimate without bias that owes
 * nothing to the flight that took the way. segment: 0 of a flight, else which one of a connection */
INLINE void segment_column_density(const Launch* launch, const Medium* medium, const Random* random, int segment,
                                   REAL3 from, REAL3 direction, REAL distance, MASK mask,
                                   REAL column_density[FIELD_CHANNELS]) {
  UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c) column_density[c] = distance;
#if HAS_FIELDS
  if (!extinction_is_scored()) return;
  const MASK in_field = mask & (medium->field >= 0);
  uint left = lane_bits(in_field);
  if (!left) return;
  UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c) column_density[c] = SELECT(in_field, 0.0f, distance);
  REAL u[4];
  draw(random, (uint)(STREAM_COLUMN_DENSITY + segment), u);
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, medium->field, &left, &field);
    field_column_density(launch, field, from, direction, distance, u[0], here, column_density);
  }
#endif
}

/* Transmittance of a way, a throughput channel each: an estimate where the medium has a field. segment: of the connection */
INLINE void segment_transmittance(const Launch* launch, const Medium* medium, const Random* random, int segment,
                                  REAL3 from, REAL3 direction, REAL distance, MASK mask, REAL through[]) {
#if HAS_FIELDS
  const MASK in_field = mask & (medium->field >= 0);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c)
    through[c] = SELECT(in_field, 1.0f, medium_transmittance(medium->n[MEDIUM_sigma_t + c], distance));
  uint left = lane_bits(in_field);
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, medium->field, &left, &field);
    field_transmittance(launch, field, random, segment, from, direction, distance, medium->n + MEDIUM_sigma_t, here,
                        through);
  }
#else
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c)
    through[c] = medium_transmittance(medium->n[MEDIUM_sigma_t + c], distance);
#endif
}

/* Adds a way of that column density to the scores of a medium, in the lanes whose medium is of the model. `meets`: the
 * way reaches a surface or a light; `scatters`: it ends in a scattering. */
#define ADD_WAY(event, mask)                                                   \
  {                                                                            \
    REAL d[MOST_SLOTS * CHANNELS];                                             \
    UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) d[i] = (REAL)(0.0f); \
    SCORES_OF_WAY(event)                                                       \
    add_step(&step, d, mask);                                                  \
  }
#if FIELD_CHANNELS == 3
#define SCORES_OF_WAY(event)                                                     \
  UNROLL_FOR(int c = 0; c < 3; ++c) {                                            \
    REAL own[MOST_SLOTS * CHANNELS];                                             \
    UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) own[i] = (REAL)(0.0f); \
    event(medium->n, column_density[c], own);                                    \
    UNROLL_FOR(int i = c; i < MOST_SLOTS * CHANNELS; i += 3) d[i] = own[i];      \
  }
#else
#define SCORES_OF_WAY(event) event(medium->n, column_density[0], d);
#endif

/* A flight, to the scores and to the baseline: see add_flight. */
INLINE void add_medium_flight(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                              Scores* scores, Baseline* baseline, const Medium* medium, const REAL column_density[],
                              MASK meets, MASK scatters, const REAL weight[], INT state) {
#define ADD_MEDIUM_FLIGHT(name, PREFIX)                                                                    \
  {                                                                                                        \
    Step step = no_step(medium->first);                                                                    \
    ADD_WAY(score_##name##_passage, IN_MEDIUM(name, meets))                                                \
    ADD_WAY(score_##name##_scattering, IN_MEDIUM(name, scatters))                                          \
    add_flight(launch, job, pool, slots, scores, baseline, MODEL_##name, medium->n, &step, weight, state); \
  }
  MEDIA_OF_SCENE(ADD_MEDIUM_FLIGHT);
}

/* A passage of a connection, to the scores. */
INLINE void add_passage(__global const JobRecord* job, Scores* scores, const Medium* medium,
                        const REAL column_density[], MASK mask) {
#define ADD_PASSAGE(name, PREFIX)                                  \
  {                                                                \
    Step step = no_step(medium->first);                            \
    ADD_WAY(score_##name##_passage, IN_MEDIUM(name, mask))         \
    add_scores(job, scores, MODEL_##name, medium->n, &step, true); \
  }
  MEDIA_OF_SCENE(ADD_PASSAGE);
}

/* Replay: to the sums of the numbers. */
INLINE void sum_medium(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                       const Scores* scores, const Medium* medium, MASK mask) {
#define SUM_MEDIUM(name, PREFIX) \
  sum_scores(launch, job, pool, slots, scores, MODEL_##name, medium->first, 0, IN_MEDIUM(name, mask));
  MEDIA_OF_SCENE(SUM_MEDIUM)
}

/* Replay: a way through a medium, to the sums by voxels. segment: as of segment_column_density; adjoint: that of
 * what comes over it, in each channel of the radiance */
INLINE void sum_way_by_voxels(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                              const Medium* medium, const Random* random, int segment, REAL3 from, REAL3 direction,
                              REAL distance, MASK mask, const REAL adjoint[]) {
#if VOXEL_SUMS
  uint left = lane_bits(mask & (medium->field >= 0));
  if (!left) return;
  REAL u[4], x[RADIANCE_CHANNELS];
  draw(random, (uint)(STREAM_COLUMN_DENSITY + segment), u);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
    x[c] = -adjoint[c] * medium->n[MEDIUM_sigma_t + (THROUGHPUT_CHANNELS == 1 ? 0 : c)];
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, medium->field, &left, &field);
    if (field->gradient >= 0)
      add_way_to_voxels(launch, job, pool, slots, here, field, from, direction, distance, u[0], x);
  }
#endif
}

#if VOXEL_SUMS
/* A scattering at `place`, at the end of a flight, which goes to the sums as ways do. */
INLINE void sum_scattering_by_voxels(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                                     const Medium* medium, const Flight* flight, REAL3 place, MASK mask,
                                     const REAL adjoint[]) {
  uint left = lane_bits(mask & (medium->field >= 0));
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, medium->field, &left, &field);
    if (field->gradient < 0) continue;
    const REAL knee = knee_of(field, mean_sigma_t(medium->n + MEDIUM_sigma_t));
    REAL x[RADIANCE_CHANNELS];
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
      x[c] = adjoint[c] / MAX(flight->there[FIELD_CHANNELS == 3 ? c : 0], knee);
    add_to_voxels(launch, job, pool, slots, here, field, place, x);
  }
}

/* The albedo at a scattering at `place`: the field there, since the number that it is times is 1. */
INLINE void sum_albedo_by_voxels(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                                 const Medium* medium, REAL3 place, const REAL albedo[], MASK mask,
                                 const REAL adjoint[]) {
  uint left = lane_bits(mask & (medium->albedo_field >= 0));
  while (left) {
    __global const FieldRecord* field;
    const MASK here = next_field(launch, medium->albedo_field, &left, &field);
    if (field->gradient < 0) continue;
    REAL x[RADIANCE_CHANNELS];
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
      x[c] = adjoint[c] / MAX(albedo[THROUGHPUT_CHANNELS == 1 ? 0 : c], (REAL)(ALBEDO_KNEE));
    add_to_voxels(launch, job, pool, slots, here, field, place, x);
  }
}
#endif

/* The score that a passage adds to carried[k], a score of passages: it is the same whatever sigma_t is. */
INLINE REAL score_of_passage(int k, REAL column_density) {
  REAL d[MOST_SLOTS * CHANNELS], ones[MOST_SLOTS];
  UNROLL_FOR(int i = 0; i < MOST_SLOTS; ++i) ones[i] = (REAL)(1.0f);
#define SCORE_OF_PASSAGE(name, PREFIX) \
  if (carried[k].model == MODEL_##name) score_##name##_passage(ones, column_density, d);
  MEDIA_OF_SCENE(SCORE_OF_PASSAGE)
  return d[carried[k].slot * CHANNELS + (CHANNELS == 1 ? 0 : carried[k].channel)];
}

#endif
