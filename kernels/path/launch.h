/* Everything a stage reads, and the queues that paths wait in for the next one. */
#ifndef ITN_LAUNCH_H
#define ITN_LAUNCH_H
#include "geometry/flight_grid.h"
#include "path/pool.h"
#include "geometry/trace.h"
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
#define PROBE_TOTALS (VOXEL_SUMS > 0)                                    /* as well: scattering/probe.h */
#define IMAGES (1 + DERIVATIVES + ALBEDOS)
#define SAMPLE_SIZE (RADIANCE_CHANNELS * IMAGES + BASELINE_TOTALS + PROBE_TOTALS)

__constant PartRecord parts[PARTS + 1] = {PART_RECORDS};

#define FIELD_OF(record, member) \
  ((int)(((__global const char*)&((__global const record*)0)->member - (__global const char*)0) / 4))

INLINE Surfaces job_surfaces(const Launch* launch, __global const JobRecord* job) {
  return surfaces_of(launch->nodes, launch->leaves, launch->primitives, launch->geometries + job->geometry);
}

INLINE INT plain_depth(INT depth) {
#if OPERATOR_SINGLE
  return depth & (SCATTERED_ONCE - 1);
#else
  return depth;
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
