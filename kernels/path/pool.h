/* A pool of path slots with its queues, in global memory.
 *
 * FUSED 1 (CPUs): every work-item owns one pool and runs all stages over it; queue lengths are private.
 * FUSED 0 (GPUs, stage tests): one pool for all work-items, one kernel a stage; queues are double-buffered (a stage
 * reads one half and pushes go to the other) and their lengths are global atomics. The order of paths in a queue
 * differs between the two, and nothing that a path computes depends on it. */
#ifndef ITN_POOL_H
#define ITN_POOL_H
#include "shared/vector.h"
#include "program/surfaces.h"
#include "shared/path_state.h"

typedef struct {
  __global float* fields;
  int stride;          /* slots + WIDTH: the last WIDTH slots are a dump for idle lanes */
  __global int* items; /* queue q: items[q * stride ...] (FUSED 0: its half for pushes) */
#if FUSED
  int length[QUEUES];
#else
  __global int* length; /* of the halves for pushes */
#endif
} Pool;

#define LOAD(pool, field, slots) GATHER(((pool)->fields + (field) * (pool)->stride), slots)
#define LOAD_INT(pool, field, slots) GATHER_INT(((__global int*)(pool)->fields + (field) * (pool)->stride), slots)
#define STORE(pool, field, slots, value) SCATTER((pool)->fields + (field) * (pool)->stride, slots, (REAL)(value))
#define STORE_INT(pool, field, slots, value) STORE(pool, field, slots, AS_REAL((INT)(value)))

__attribute__((always_inline)) INLINE REAL3 load3(const Pool* pool, int field, INT slots) {
  return make3(LOAD(pool, field, slots), LOAD(pool, field + 1, slots), LOAD(pool, field + 2, slots));
}
__attribute__((always_inline)) INLINE void store3(const Pool* pool, int field, INT slots, REAL3 v) {
  STORE(pool, field, slots, v.x);
  STORE(pool, field + 1, slots, v.y);
  STORE(pool, field + 2, slots, v.z);
}

INLINE void push(Pool* pool, int queue, INT slots, MASK mask) {
  Lanes slot;
  slot.integer = slots;
  uint bits = lane_bits(mask);
#if FUSED
  __global int* items = pool->items + queue * pool->stride;
  int length = pool->length[queue];
  FOR_EACH_LANE(l, bits) items[length++] = slot.i[l];
  pool->length[queue] = length;
#else
  FOR_EACH_LANE(l, bits) pool->items[queue * pool->stride + atomic_inc(pool->length + queue)] = slot.i[l];
#endif
}

#endif
