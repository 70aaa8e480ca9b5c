// Runs sample_light of kernels/lib/light_sampling.h alone: one work-item a group of WIDTH lanes; arrays hold one component
// after another.
#include "lib/light_sampling.h"

__kernel void sample(__global const EmitterRecord* record, __global const float* tables, int at_surface,
                     __global const float* u, __global float* out) {
  const int n = (int)get_global_size(0) * WIDTH;
  const INT at = LANE_INDEX + (int)get_global_id(0) * WIDTH;
  Launch launch;
  launch.emitter_tables = tables;
  const REAL numbers[3] = {GATHER(u, at), GATHER(u, at + n), GATHER(u, at + 2 * n)};
  REAL3 direction;
  REAL pdf, rgb[3];
  const MASK sampled = sample_light(&launch, record, ((INT)at_surface) != 0, numbers, &direction, &pdf, rgb);
  SCATTER(out, at, pdf);
  for (int c = 0; c < 3; ++c) SCATTER(out, at + (c + 1) * n, SELECT(sampled, rgb[c], 0.0f));
}
