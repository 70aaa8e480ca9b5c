// Runs sample_light of kernels/lib/light_sampling.h alone: one work-item a group of WIDTH lanes; arrays hold one
// component after another.
#include "lib/light_sampling.h"

__kernel void sample(__global const JobRecord* job, __global const EnvironmentRecord* record,
                     __global const float* tables, int at_surface, __global const float* u, __global float* out) {
  const int n = (int)get_global_size(0) * WIDTH;
  const INT at = LANE_INDEX + (int)get_global_id(0) * WIDTH;
  Launch launch;
  launch.light_tables = tables;
  launch.environments = record;
  REAL numbers[4] = {GATHER(u, at), GATHER(u, at + n), GATHER(u, at + 2 * n), (REAL)(0.0f)};
  LightSample light;
  const REAL3 anywhere = make3((REAL)(0.0f), (REAL)(0.0f), (REAL)(0.0f));
  const MASK sampled = sample_light(&launch, job, ((INT)at_surface) != 0, anywhere, numbers, &light);
  SCATTER(out, at, light.pdf);
  for (int c = 0; c < 3; ++c) SCATTER(out, at + (c + 1) * n, SELECT(sampled, light.rgb[c], 0.0f));
}
