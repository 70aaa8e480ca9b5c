/* The wavefront: which stage runs next. The stages themselves are in stage/, one a file.
 *
 * FUSED 1: one kernel, trace_paths; each work-item works off chunks of paths with a pool of its own.
 * FUSED 0: one kernel a stage over a pool in global memory; the host launches them in turn (runtime/wavefront). */
#include "lib/launch.h"
#include "stage/generate.h"
#include "stage/ray.h"
#include "stage/escape.h"
#include "stage/null.h"
#include "stage/diffuse.h"
#include "stage/dielectric.h"
#include "stage/rough_dielectric.h"
#include "stage/medium.h"
#include "stage/connect.h"

#define SCENE_PARAMETERS                                                                                          \
  __global const float *restrict nodes, __global const float *restrict leaves,                                    \
      __global const PrimitiveRecord *restrict primitives, __global const uint *restrict grid,                    \
      __global const GeometryRecord *restrict geometries, __global const JobRecord *restrict jobs,                \
      __global const CameraRecord *restrict cameras, __global const ShapeRecord *restrict shapes,                 \
      __global const BsdfRecord *restrict bsdfs, __global const MediumRecord *restrict media,                     \
      __global const EmitterRecord *restrict emitters, __global const float *restrict emitter_tables,             \
      __global const TextureRecord *restrict textures, __global const float *restrict texels,                     \
      __global const DerivativeRecord *restrict derivatives, __global const float *restrict futures,              \
      __global float *restrict visits,                                                                            \
      __global const float *restrict pulls, __global uint *restrict gradient,                                     \
      __global float *restrict samples, __global uint *restrict misplaced
#define SCENE_LAUNCH                                                                                              \
  {nodes, leaves, primitives, grid, geometries, jobs, cameras, shapes, bsdfs, media, emitters, emitter_tables,    \
   textures, texels, derivatives, futures, visits, pulls, gradient, samples, misplaced}

/* Runs the stage of a queue over one group of slots. */
inline void run_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, int queue, INT slots,
                      MASK valid) {
  switch (queue) {
    case QUEUE_RAY: ray_stage(launch, job, pool, slots, valid); break;
    case QUEUE_ESCAPE: escape_stage(launch, job, pool, slots, valid); break;
#if HAS_NULL
    case QUEUE_NULL: null_stage(launch, job, pool, slots, valid); break;
#endif
#if HAS_DIFFUSE
    case QUEUE_DIFFUSE: diffuse_stage(launch, job, pool, slots, valid); break;
#endif
#if HAS_DIELECTRIC
    case QUEUE_DIELECTRIC: dielectric_stage(launch, job, pool, slots, valid); break;
#endif
#if HAS_ROUGH_BECKMANN
    case QUEUE_ROUGH_BECKMANN: rough_dielectric_stage(MICROFACET_BECKMANN, launch, job, pool, slots, valid); break;
#endif
#if HAS_ROUGH_GGX
    case QUEUE_ROUGH_GGX: rough_dielectric_stage(MICROFACET_GGX, launch, job, pool, slots, valid); break;
#endif
#if HAS_MEDIUM
    case QUEUE_MEDIUM: medium_stage(launch, job, pool, slots, valid, WIDTH / 2); break;
#endif
#if MEDIUM_LIGHT_SAMPLING
    case QUEUE_CONNECT: connect_stage(launch, job, pool, slots, valid); break;
#endif
    default: break;
  }
}

#if FUSED

/* WIDTH slots off the top of a queue; lanes beyond its length get slots of the dump and are not valid. */
inline INT pop_group(Pool* pool, int queue, MASK* valid) {
  int length = pool->length[queue], count = min(length, WIDTH);
  __global const int* items = pool->items + queue * pool->stride;
  pool->length[queue] = length - count;
  Lanes slot;
  UNROLL for (int l = 0; l < WIDTH; ++l)
    slot.i[l] = l < count ? items[length - count + l] : pool->stride - WIDTH + l;
  *valid = LANE_INDEX < count;
  return slot.integer;
}

__kernel __attribute__((reqd_work_group_size(1, 1, 1))) void trace_paths(SCENE_PARAMETERS,
                                                                         __global const ChunkRecord* restrict chunks,
                                                                         int chunk_count,
                                                                         __global int* restrict next_chunk,
                                                                         __global float* restrict storage) {
  Launch launch = SCENE_LAUNCH;
#if ADJOINT
  launch.gradient += get_global_id(0) * (size_t)(2 * GRADIENT_SETS * (NUMBERS + 1)); /* each work-item sums on its own */
#endif
  Pool pool;
  pool.stride = SLOTS + WIDTH;
  pool.fields = storage + get_global_id(0) * (size_t)(FIELDS + QUEUES) * (SLOTS + WIDTH);
  pool.items = (__global int*)(pool.fields + FIELDS * pool.stride);
  for (int q = 0; q < QUEUES; ++q) pool.length[q] = 0;
  for (int s = 0; s < SLOTS; ++s) pool.items[QUEUE_FREE * pool.stride + s] = s;
  pool.length[QUEUE_FREE] = SLOTS;
  for (int f = 0; f < FIELDS; ++f)
    UNROLL for (int l = 0; l < WIDTH; ++l) pool.fields[f * pool.stride + SLOTS + l] = 0.0f;

  for (int c = atomic_inc(next_chunk); c < chunk_count;) {
    const int job_index = chunks[c].job;
    __global const JobRecord* job = jobs + job_index;
    int next = chunks[c].first, last = next + chunks[c].count;
    bool same_job = true; /* chunk c is of this job, and has begun */
    for (;;) {
      if (next == last && same_job) { /* goes on with the pool full */
        c = atomic_inc(next_chunk);
        same_job = c < chunk_count && chunks[c].job == job_index;
        if (same_job) {
          next = chunks[c].first;
          last = next + chunks[c].count;
        }
      }
      /* a full group of some stage, latest stage first; else new paths; else what is left */
      int queue = -1, longest = 0;
      for (int q = QUEUES - 1; q > QUEUE_FREE; --q)
        if (pool.length[q] > longest) {
          longest = pool.length[q];
          queue = q;
        }
      MASK valid;
      if (longest < GENERATE_BELOW && next < last && pool.length[QUEUE_FREE] > 0) {
        int count = min(min(pool.length[QUEUE_FREE], WIDTH), last - next);
        INT slots = pop_group(&pool, QUEUE_FREE, &valid);
        /* slots that the last, partial group does not use go back */
        push(&pool, QUEUE_FREE, slots, valid & (LANE_INDEX >= count));
        Lanes pixel, sample;
        UNROLL for (int l = 0; l < WIDTH; ++l) {
          int path = min(next + l, last - 1), row = path / job->samples;
          pixel.i[l] = job->first_pixel + row * job->pixel_step;
          sample.i[l] = job->first_sample + path - row * job->samples;
        }
        next += count;
        generate_stage(&launch, job_index, &pool, slots, valid & (LANE_INDEX < count), pixel.integer, sample.integer);
      } else if (queue >= 0) {
        INT slots = pop_group(&pool, queue, &valid);
        run_stage(&launch, job, &pool, queue, slots, valid);
      } else {
        break;
      }
    }
  }
}

#else

/* queues: items of both halves, [half][queue][stride]; lengths: [half][queue]. halves: bit q tells from which half stage q
 * reads; pushes go to the other. */
inline Pool open_pool(__global float* storage, int slots, __global int* lengths, int push_half) {
  Pool pool;
  pool.stride = slots + WIDTH;
  pool.fields = storage;
  pool.items = (__global int*)(storage + FIELDS * pool.stride) + push_half * QUEUES * pool.stride;
  pool.length = lengths + push_half * QUEUES;
  return pool;
}

__kernel void fill_free_queue(__global float* restrict storage, int slots, __global int* restrict lengths) {
  int s = get_global_id(0);
  Pool pool = open_pool(storage, slots, lengths, 0);
  if (s < slots) pool.items[QUEUE_FREE * pool.stride + s] = s;
  if (s == 0) {
    for (int q = 0; q < 2 * QUEUES; ++q) lengths[q] = 0;
    lengths[QUEUE_FREE] = slots;
  }
}

/* Starts paths next_path ... of the chunk table (flattened) in the free slots; lanes of different jobs one after the other. */
__kernel void generate(SCENE_PARAMETERS, __global const ChunkRecord* restrict chunks, int chunk_count, int next_path,
                       int path_count, __global float* restrict storage, int slots, __global int* restrict lengths,
                       int from_half) {
  Launch launch = SCENE_LAUNCH;
  Pool pool = open_pool(storage, slots, lengths, !from_half);
  int group = get_global_id(0) * WIDTH, length = lengths[from_half * QUEUES + QUEUE_FREE];
  if (group >= length) return;
  __global const int* items = (__global const int*)(storage + FIELDS * pool.stride) +
                              (from_half * QUEUES + QUEUE_FREE) * pool.stride;
  const int starting = min(length - group, path_count - next_path - group); /* lanes that get a path */
  Lanes slot, pixel, sample, job_of;
  for (int l = 0; l < WIDTH; ++l) {
    slot.i[l] = group + l < length ? items[group + l] : pool.stride - WIDTH + l;
    pixel.i[l] = sample.i[l] = job_of.i[l] = 0;
    if (l >= starting) continue;
    int path = next_path + group + l;
    int low = 0, high = chunk_count - 1; /* last chunk that starts at or before the path */
    while (low < high) {
      int middle = (low + high + 1) / 2;
      if (chunks[middle].start <= path) low = middle;
      else high = middle - 1;
    }
    int in_job = chunks[low].first + path - chunks[low].start;
    __global const JobRecord* job = jobs + chunks[low].job;
    int row = in_job / job->samples;
    job_of.i[l] = chunks[low].job;
    pixel.i[l] = job->first_pixel + row * job->pixel_step;
    sample.i[l] = job->first_sample + in_job - row * job->samples;
  }
  MASK starts = LANE_INDEX < starting;
  push(&pool, QUEUE_FREE, slot.integer, (LANE_INDEX + group < length) & !starts);
  uint left = lane_bits(starts);
  while (left) {
    int current = job_of.i[LOWEST_BIT(left)];
    MASK mask = starts & (job_of.integer == current);
    INT group_slots = SELECT_INT(mask, slot.integer, pool.stride - WIDTH + LANE_INDEX);
    generate_stage(&launch, current, &pool, group_slots, mask, pixel.integer, sample.integer);
    left &= ~lane_bits(mask);
  }
}

/* One group of a stage; lanes of different jobs run one after the other. */
__kernel void stage(SCENE_PARAMETERS, int queue, __global float* restrict storage, int slots,
                    __global int* restrict lengths, int from_half) {
  Launch launch = SCENE_LAUNCH;
  Pool pool = open_pool(storage, slots, lengths, !from_half);
  int group = get_global_id(0) * WIDTH, length = lengths[from_half * QUEUES + queue];
  if (group >= length) return;
  __global const int* items =
      (__global const int*)(storage + FIELDS * pool.stride) + (from_half * QUEUES + queue) * pool.stride;
  Lanes slot;
  UNROLL for (int l = 0; l < WIDTH; ++l) slot.i[l] = group + l < length ? items[group + l] : pool.stride - WIDTH + l;
  MASK valid = LANE_INDEX + group < length;
  INT job = LOAD_INT(&pool, JOB, slot.integer);
  uint left = lane_bits(valid);
  Lanes job_of;
  job_of.integer = job;
  while (left) {
    int current = job_of.i[LOWEST_BIT(left)];
    MASK mask = valid & (job == current);
    INT group_slots = SELECT_INT(mask, slot.integer, pool.stride - WIDTH + LANE_INDEX);
    run_stage(&launch, jobs + current, &pool, queue, group_slots, mask);
    left &= ~lane_bits(mask);
  }
}

__kernel void reset_queue(__global int* restrict lengths, int queue, int half_index) {
  lengths[half_index * QUEUES + queue] = 0;
}

#endif
