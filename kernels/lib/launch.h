/* Everything a stage reads, and what every stage does with it: random numbers, roulette, the end of a path. */
#ifndef ITN_LAUNCH_H
#define ITN_LAUNCH_H
#include "lib/environment.h"
#include "lib/flight_grid.h"
#include "lib/pool.h"
#include "lib/random.h"
#include "lib/trace.h"
#include "shared/vector.h"
#include "model/models.h"
#include "shared/baseline_layout.h"
#include "shared/launch_arguments.h"
#include "shared/light_layout.h"
#include "shared/scene_layout.h"

#define LAUNCH_MEMBER(type, name) __global type* name;
typedef struct {
  LAUNCH_ARGUMENTS(LAUNCH_MEMBER)
} Launch;

#define BASELINE_TOTALS (ADJOINT && BASELINES ? THROUGHPUT_CHANNELS : 0) /* at a sample's end, for its replay */
#define PROBE_TOTALS (VOXEL_SUMS > 0)                                    /* as well: lib/probe.h */
#define IMAGES (1 + DERIVATIVES + ALBEDOS)
#define SAMPLE_SIZE (RADIANCE_CHANNELS * IMAGES + BASELINE_TOTALS + PROBE_TOTALS)

__constant PartRecord parts[PARTS + 1] = {PART_RECORDS};

#define FIELD_OF(record, member) \
  ((int)(((__global const char*)&((__global const record*)0)->member - (__global const char*)0) / 4))

INLINE Surfaces job_surfaces(const Launch* launch, __global const JobRecord* job) {
  return surfaces_of(launch->nodes, launch->leaves, launch->primitives, launch->geometries + job->geometry);
}

/* Random numbers of one event of each path. */
typedef struct {
  UINT pixel, sample;
  INT event;
  uint seed_low, seed_high;
} Random;

__attribute__((always_inline)) INLINE Random load_random(__global const JobRecord* job, const Pool* pool, INT slots) {
  Random r;
  r.pixel = AS_UINT(LOAD_INT(pool, PIXEL, slots));
  r.sample = AS_UINT(LOAD_INT(pool, SAMPLE, slots));
  r.event = LOAD_INT(pool, EVENT, slots);
  r.seed_low = job->seed_low;
  r.seed_high = job->seed_high;
  return r;
}
INLINE void draw(const Random* r, uint stream, REAL u[4]) {
  random4(r->pixel, r->sample, AS_UINT(r->event), stream, r->seed_low, r->seed_high, u);
}

/* Weight of each throughput channel beyond the throughput: one-pass spectral MIS (balance heuristic over the channels
 * whose sigma_t could have been the hero's), 3 p_c / (p_0 + p_1 + p_2) for the densities p_c of the path with each
 * channel's sigma_t. Paths carry these weights: unlike the densities or their ratios they stay in [0, 3], however long
 * the path. */
#if SPECTRAL
/* An event of the lanes in `mask`, with density `factor` of each channel, over any common one. Should none of the
 * channels be possible, which takes the underflow of the hero's own weight, all weights are 0 and roulette ends the
 * path. */
INLINE void spectral_event(MASK mask, const REAL factor[3], REAL weight[3]) {
  REAL sum = (REAL)(0.0f);
  UNROLL_FOR(int c = 0; c < 3; ++c) sum += weight[c] * factor[c];
  const REAL inverse = 3.0f / MAX(sum, (REAL)(1e-30f));
  UNROLL_FOR(int c = 0; c < 3; ++c) weight[c] = SELECT(mask, weight[c] * factor[c] * inverse, weight[c]);
}
#endif

/* Of the path's hero channel. */
INLINE REAL of_hero(const REAL of[], INT hero) {
#if SPECTRAL
  return SELECT(hero == 0, of[0], SELECT(hero == 1, of[1], of[2]));
#else
  return of[0];
#endif
}

/* The sigma_t for choices that the weights must not depend on: the same whatever the path's hero channel, or MIS
 * weights would not add up, nor baselines have mean zero. */
INLINE REAL mean_sigma_t(const REAL sigma_t[]) {
#if SPECTRAL
  return (sigma_t[0] + sigma_t[1] + sigma_t[2]) * (1.0f / 3.0f);
#else
  return sigma_t[0];
#endif
}

/* `scale` times the weights of paths between two stages. Without RGB sigma_t these are 1. */
INLINE void channel_weights(const Pool* pool, INT slots, REAL scale, REAL weight[3]) {
#if SPECTRAL
  UNROLL_FOR(int c = 0; c < 3; ++c) weight[c] = LOAD(pool, SPECTRAL_WEIGHT + c, slots) * scale;
#else
  weight[0] = weight[1] = weight[2] = scale;
#endif
}

INLINE INT plain_depth(INT depth) {
#if OPERATOR_SINGLE
  return depth & (SCATTERED_ONCE - 1);
#else
  return depth;
#endif
}

#define FAINT 0.5f               /* throughput below which paths may end */
#define PATIENCE 512             /* vertices after which paths may end that lose nothing, until */
#define HEAVY 16.0f              /* their throughput has been raised to this */
#define LASTS_IN_MEDIA 1.0f      /* survival of heavy paths */
#define LASTS_AT_SURFACES 0.999f /* some paths never leave smooth glass, or a white room without a window */

/* Russian roulette: from rr_depth on, paths whose largest throughput is below FAINT survive with throughput over FAINT,
 * which raises it to FAINT, never more. Brighter ones go on. But after PATIENCE vertices they survive with 0.95, as in
 * Mitsuba, until their throughput has been raised to HEAVY: for ever it would end all that take long, and raise the rest
 * without bound. From there on they survive with `lasts`. Returns who dies; survivors' throughput is raised in place. */
INLINE MASK roulette(const Launch* launch, __global const JobRecord* job, INT depth, REAL u, MASK active, REAL largest,
                     float lasts, REAL throughput[]) {
  const float tired = job->is_stuck ? lasts : 0.95f; /* of paths that go nowhere none may end without being counted */
  const REAL longest = SELECT(depth <= PATIENCE, (REAL)(1.0f), SELECT(largest < HEAVY, (REAL)tired, (REAL)lasts));
  REAL survival = MIN(largest * (1.0f / FAINT), longest);
  MASK plays = active & (depth > job->rr_depth);
  MASK dies = (active & (largest <= 0.0f)) | (plays & (u >= survival));
  REAL raise = SELECT(plays & !dies, 1.0f / MAX(survival, (REAL)1e-20f), 1.0f);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) throughput[c] *= raise;
  const MASK ends = active & !dies & (depth >= job->max_depth);
  if (job->is_endless && ANY(ends)) atomic_add(launch->endless, popcount(lane_bits(ends)));
  return dies | ends;
}

/* The largest channel with its spectral weight. */
INLINE REAL brightest(const REAL throughput[], const REAL weight[3]) {
#if THROUGHPUT_CHANNELS == 1
  return throughput[0];
#else
  return MAX(throughput[0] * weight[0], MAX(throughput[1] * weight[1], throughput[2] * weight[2]));
#endif
}

#if HAS_HIDDEN_LIGHTS
/* Does a path that has scattered `depth` times go straight on through the shape, as if it were not there? */
INLINE bool is_hidden(const Launch* launch, __global const JobRecord* job, int shape, int depth) {
  return job->hide_emitters && launch->shapes[shape].light != -1 && depth == 0;
}
#endif

/* Paths that have arrived at primitives wait for the stage of their boundary. */
INLINE void push_surface(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK mask,
                         INT primitive) {
  Lanes slot, hit;
  slot.integer = slots;
  hit.integer = primitive;
  uint bits = lane_bits(mask);
  FOR_EACH_LANE(l, bits) {
    int shape = job->first_shape + launch->primitives[hit.i[l]].shape;
    int queue = QUEUE_SURFACE + launch->bsdfs[launch->shapes[shape].bsdf].surface;
#if HAS_HIDDEN_LIGHTS
    const int depth = ((__global const int*)pool->fields)[DEPTH * pool->stride + slot.i[l]];
    if (is_hidden(launch, job, shape, depth)) queue = QUEUE_SURFACE;
#endif
#if FUSED
    pool->items[queue * pool->stride + pool->length[queue]++] = slot.i[l];
#else
    pool->items[queue * pool->stride + atomic_inc(pool->length + queue)] = slot.i[l];
#endif
  }
}

#endif
