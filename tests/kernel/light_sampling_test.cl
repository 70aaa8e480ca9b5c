// Runs sample_light_around of kernels/light/light_sampling.h alone: one work-item a group of WIDTH lanes; arrays hold
// one component after another.
#include "light/light_sampling.h"

__kernel void sample(__global const JobRecord* job, __global const EnvironmentRecord* record,
                     __global const float* tables, int at_surface, __global const float* u, __global float* out) {
  const int n = (int)get_global_size(0) * WIDTH;
  const INT at = LANE_INDEX + (int)get_global_id(0) * WIDTH;
  Launch launch;
  launch.light_tables = tables;
  launch.environments = record;
  LightSample light;
  const MASK sampled = sample_light_around(&launch, job, at_surface != 0, GATHER(u, at), GATHER(u, at + n), &light);
  SCATTER(out, at, light.pdf);
  for (int c = 0; c < 3; ++c) SCATTER(out, at + (c + 1) * n, SELECT(sampled, light.rgb[c], 0.0f));
}
