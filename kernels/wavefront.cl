/* The wavefront: which stage runs next. The stages themselves are in stage/, one a file.
 *
 * FUSED 1: one kernel, trace_paths; each work-item works off chunks of paths with a pool of its own.
 * FUSED 0: one kernel a stage over a pool in global memory; the host launches them in turn (runtime/render/wavefront). */
#include "path/launch.h"
#include "stage/generate.h"
#include "stage/ray.h"
#include "stage/escape.h"
#include "stage/null.h"
#include "stage/opaque.h"
#include "stage/boundary.h"
#include "stage/medium.h"
#include "stage/connect.h"

#define LAUNCH_PARAMETER(type, name) __global type *restrict name,
#define LAUNCH_PARAMETERS LAUNCH_ARGUMENTS(LAUNCH_PARAMETER)
#define LAUNCH_VALUE(type, name) name,
#define LAUNCH \
  { LAUNCH_ARGUMENTS(LAUNCH_VALUE) }

/* Surfaces of one BSDF. */
INLINE void surface_stage(int model, int variant, const Launch* launch, __global const JobRecord* job, Pool* pool,
                          INT slots, MASK valid) {
  if (bsdf_traits(model) & BSDF_TRANSMITS)
    boundary_stage(model, variant, launch, job, pool, slots, valid);
  else
    opaque_stage(model, variant, launch, job, pool, slots, valid);
}

#if FUSED

/* Runs the stage of a queue over one group of slots. */
INLINE void run_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, int queue, INT slots,
                      MASK valid) {
  switch (queue) {
    case QUEUE_RAY: ray_stage(launch, job, pool, slots, valid); break;
    case QUEUE_ESCAPE: escape_stage(launch, job, pool, slots, valid); break;
#if HAS_MEDIUM
    case QUEUE_MEDIUM: medium_stage(launch, job, pool, slots, valid, WIDTH / 2); break;
#endif
#if MEDIUM_LIGHT_SAMPLING
    case QUEUE_CONNECT: connect_stage(launch, job, pool, slots, valid); break;
#endif
#if HAS_NULL
    case QUEUE_SURFACE: null_stage(launch, job, pool, slots, valid); break;
#endif
#define RUN_SURFACE(surface, name, variant) \
  case QUEUE_SURFACE + surface: surface_stage(MODEL_##name, variant, launch, job, pool, slots, valid); break;
      SURFACE_LIST(RUN_SURFACE)
    default: break;
  }
}

/* WIDTH slots off the top of a queue; lanes beyond its length get slots of the dump and are not valid. */
INLINE INT pop_group(Pool* pool, int queue, MASK* valid) {
  int length = pool->length[queue], count = min(length, WIDTH);
  __global const int* items = pool->items + queue * pool->stride;
  pool->length[queue] = length - count;
  Lanes slot;
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) slot.i[l] = l < count ? items[length - count + l] : pool->stride - WIDTH + l;
  *valid = LANE_INDEX < count;
  return slot.integer;
}

/* The pool of this work-item: every slot free. */
INLINE void open_own_pool(Pool* pool, __global float* storage) {
  pool->stride = SLOTS + WIDTH;
  pool->fields = storage + get_global_id(0) * (size_t)(FIELDS + QUEUES) * (SLOTS + WIDTH);
  pool->items = (__global int*)(pool->fields + FIELDS * pool->stride);
  for (int q = 0; q < QUEUES; ++q) pool->length[q] = 0;
  for (int s = 0; s < SLOTS; ++s) pool->items[QUEUE_FREE * pool->stride + s] = s;
  pool->length[QUEUE_FREE] = SLOTS;
  for (int f = 0; f < FIELDS; ++f)
    UNROLL_FOR(int l = 0; l < WIDTH; ++l) pool->fields[f * pool->stride + SLOTS + l] = 0.0f;
}

/* The queue with the most slots, the latest stage of equally long ones; -1: all are empty. */
INLINE int longest_queue(const Pool* pool, int* longest) {
  int queue = -1;
  *longest = 0;
  for (int q = QUEUES - 1; q > QUEUE_FREE; --q)
    if (pool->length[q] > *longest) {
      *longest = pool->length[q];
      queue = q;
    }
  return queue;
}

/* Starts the paths first ... of a job, up to `last`, in a group of free slots. Returns how many. */
INLINE int start_paths(const Launch* launch, int job_index, Pool* pool, int first, int last) {
  __global const JobRecord* job = launch->jobs + job_index;
  const int count = min(min(pool->length[QUEUE_FREE], WIDTH), last - first);
  MASK valid;
  const INT slots = pop_group(pool, QUEUE_FREE, &valid);
  /* slots that the last, partial group does not use go back */
  push(pool, QUEUE_FREE, slots, valid & (LANE_INDEX >= count));
  Lanes pixel, sample;
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) {
    const int path = min(first + l, last - 1), row = path / job->samples;
    pixel.i[l] = job->first_pixel + row * job->pixel_step;
    sample.i[l] = job->first_sample + path - row * job->samples;
  }
  generate_stage(launch, job_index, pool, slots, valid & (LANE_INDEX < count), pixel.integer, sample.integer);
  return count;
}

/* Works off chunk c, then those of the same job that come from the counter. Returns the first that is of another job.
 * */
INLINE int trace_chunks(const Launch* launch, Pool* pool, __global const ChunkRecord* chunks, int chunk_count,
                        __global int* next_chunk, int c) {
  const int job_index = chunks[c].job;
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
    int longest;
    const int queue = longest_queue(pool, &longest);
    if (longest < GENERATE_BELOW && next < last && pool->length[QUEUE_FREE] > 0) {
      next += start_paths(launch, job_index, pool, next, last);
    } else if (queue >= 0) {
      MASK valid;
      const INT slots = pop_group(pool, queue, &valid);
      run_stage(launch, launch->jobs + job_index, pool, queue, slots, valid);
    } else {
      return c;
    }
  }
}

__kernel __attribute__((reqd_work_group_size(1, 1, 1))) void trace_paths(
    LAUNCH_PARAMETERS __global const ChunkRecord* restrict chunks, int chunk_count, __global int* restrict next_chunk,
    __global float* restrict storage) {
  Launch launch = LAUNCH;
#if ADJOINT
  launch.gradient +=
      get_global_id(0) * (size_t)(2 * launch.jobs->sets * SUMS_OF_A_SET); /* each work-item sums on its own */
#if OWN_TEXELS
  launch.texel_gradient += get_global_id(0) * (size_t)(2 * OWN_TEXELS);
#endif
#endif
  Pool pool;
  open_own_pool(&pool, storage);
  int c = atomic_inc(next_chunk);
  while (c < chunk_count) c = trace_chunks(&launch, &pool, chunks, chunk_count, next_chunk, c);
}

#else

/* queues: items of both halves, [half][queue][stride]; lengths: [half][queue]. halves: bit q tells from which half
 * stage q reads; pushes go to the other. */
INLINE Pool open_pool(__global float* storage, int slots, __global int* lengths, int push_half) {
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

/* Starts paths next_path ... of the chunk table (flattened) in the free slots; lanes of different jobs one after the
 * other. */
__kernel void generate(LAUNCH_PARAMETERS __global const ChunkRecord* restrict chunks, int chunk_count, int next_path,
                       int path_count, __global float* restrict storage, int slots, __global int* restrict lengths,
                       int from_half) {
  Launch launch = LAUNCH;
  Pool pool = open_pool(storage, slots, lengths, !from_half);
  int group = get_global_id(0) * WIDTH, length = lengths[from_half * QUEUES + QUEUE_FREE];
  if (group >= length) return;
  __global const int* items =
      (__global const int*)(storage + FIELDS * pool.stride) + (from_half * QUEUES + QUEUE_FREE) * pool.stride;
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
      if (chunks[middle].start <= path)
        low = middle;
      else
        high = middle - 1;
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

/* The paths that a work-item takes off the queue of a stage. */
typedef struct {
  INT slots;
  Lanes job;
  MASK valid;
  uint left; /* lanes whose job has not had its turn */
} Group;

INLINE Group take_group(const Pool* pool, __global const float* storage, __global const int* lengths, int from_half,
                        int queue) {
  const int group = get_global_id(0) * WIDTH, length = lengths[from_half * QUEUES + queue];
  Group g;
  g.slots = pool->stride - WIDTH + LANE_INDEX;
  g.valid = (MASK)(0);
  g.left = 0;
  if (group >= length) return g;
  __global const int* items =
      (__global const int*)(storage + FIELDS * pool->stride) + (from_half * QUEUES + queue) * pool->stride;
  Lanes slot;
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) slot.i[l] = group + l < length ? items[group + l] : pool->stride - WIDTH + l;
  g.slots = slot.integer;
  g.valid = LANE_INDEX + group < length;
  g.job.integer = LOAD_INT(pool, JOB, g.slots);
  g.left = lane_bits(g.valid);
  return g;
}

/* Lanes of different jobs run one after the other: the next job, its lanes, and slots of the dump for the others. */
INLINE int take_job(Group* g, const Pool* pool, INT* slots, MASK* valid) {
  const int job = g->job.i[LOWEST_BIT(g->left)];
  *valid = g->valid & (g->job.integer == job);
  *slots = SELECT_INT(*valid, g->slots, pool->stride - WIDTH + LANE_INDEX);
  g->left &= ~lane_bits(*valid);
  return job;
}

/* The kernel of a stage: run, over the groups of its queue. */
#define STAGE(name, queue, run)                                                              \
  __kernel void name(LAUNCH_PARAMETERS __global float* restrict storage, int slot_count,     \
                     __global int* restrict lengths, int from_half) {                        \
    const Launch all = LAUNCH;                                                               \
    const Launch* launch = &all;                                                             \
    Pool opened = open_pool(storage, slot_count, lengths, !from_half);                       \
    Pool* pool = &opened;                                                                    \
    Group group = take_group(pool, storage, lengths, from_half, queue);                      \
    while (group.left) {                                                                     \
      INT slots;                                                                             \
      MASK valid;                                                                            \
      __global const JobRecord* job = launch->jobs + take_job(&group, pool, &slots, &valid); \
      run;                                                                                   \
    }                                                                                        \
  }

STAGE(ray, QUEUE_RAY, ray_stage(launch, job, pool, slots, valid))
STAGE(escape, QUEUE_ESCAPE, escape_stage(launch, job, pool, slots, valid))
#if HAS_MEDIUM
STAGE(medium, QUEUE_MEDIUM, medium_stage(launch, job, pool, slots, valid, WIDTH / 2))
#endif
#if MEDIUM_LIGHT_SAMPLING
STAGE(connect, QUEUE_CONNECT, connect_stage(launch, job, pool, slots, valid))
#endif
#if HAS_NULL
STAGE(null, QUEUE_SURFACE, null_stage(launch, job, pool, slots, valid))
#endif
#define STAGE_OF_SURFACE(surface, name, variant)   \
  STAGE(name##_##variant, QUEUE_SURFACE + surface, \
        surface_stage(MODEL_##name, variant, launch, job, pool, slots, valid))
SURFACE_LIST(STAGE_OF_SURFACE)

__kernel void reset_queues(__global int* restrict lengths, int half_index) {
  lengths[half_index * QUEUES + get_global_id(0)] = 0;
}

#endif
