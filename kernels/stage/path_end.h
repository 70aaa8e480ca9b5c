/* The end of a path. */
#ifndef ITN_PATH_END_H
#define ITN_PATH_END_H
#include "path/launch.h"
#include "scattering/probe.h"

/* The path is complete: its radiance is written where its pixel and sample say, its slot is free. */
INLINE void finish(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK mask) {
  Lanes slot;
  slot.integer = slots;
  uint bits = lane_bits(mask);
  __global const int* ints = (__global const int*)pool->fields;
#if VOXEL_SUMS
  if (job->replay == REPLAY_PROBES) finish_probe(launch, job, pool, slots, mask);
#endif
#if ADJOINT
  if (job->replay) bits = 0; /* the samples are written already */
#endif
  FOR_EACH_LANE(l, bits) {
    int s = slot.i[l];
    int output = job->first_output +
                 (ints[PIXEL * pool->stride + s] - job->first_pixel) / job->pixel_step * job->samples +
                 ints[SAMPLE * pool->stride + s] - job->first_sample;
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS * IMAGES; ++c)
      launch->samples[output * SAMPLE_SIZE + c] = pool->fields[(RADIANCE + c) * pool->stride + s];
    UNROLL_FOR(int c = 0; c < BASELINE_TOTALS; ++c)
      launch->samples[output * SAMPLE_SIZE + RADIANCE_CHANNELS + c] = pool->fields[(BASELINE + c) * pool->stride + s];
#if VOXEL_SUMS
    launch->samples[(output + 1) * SAMPLE_SIZE - 1] = pool->fields[PROBE_PASSED * pool->stride + s];
#endif
#if BASELINES
    UNROLL_FOR(int p = 0; p < PARTS; ++p)
      UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
        const PartRecord part = parts[p];
        const int field =
            BASELINE + (THROUGHPUT_CHANNELS == 1 ? part.score[c] : part.score[c] * THROUGHPUT_CHANNELS + c);
        if (part.score[c] >= 0)
          launch->samples[output * SAMPLE_SIZE + (1 + part.image) * RADIANCE_CHANNELS + c] -=
              launch->derivatives[p].factor[c] * job->future_tint[c] * pool->fields[field * pool->stride + s];
      }
#endif
  }
  push(pool, QUEUE_FREE, slots, mask);
}

#endif
