// Runs sample_light of kernels/light/light_sampling.h for lights of the scene alone: one work-item a group of WIDTH
// lanes; arrays hold one component after another. out: direction, distance, pdf (0: nothing arrives), radiance.
#include "light/light_sampling.h"

__kernel void sample(__global const JobRecord* job, __global const LightRecord* lights, __global const float* tables,
                     __global const float* numbers, float x, float y, float z, __global const float* u,
                     __global float* out) {
  const int n = (int)get_global_size(0) * WIDTH;
  const INT at = LANE_INDEX + (int)get_global_id(0) * WIDTH;
  Launch launch;
  launch.light_tables = tables;
  launch.lights = lights;
  launch.numbers = numbers;
  REAL v[4];
  for (int i = 0; i < 4; ++i) v[i] = GATHER(u, at + i * n);
  LightSample s;
  const MASK found = sample_light(&launch, job, make3((REAL)(x), (REAL)(y), (REAL)(z)), v, &s);
  SCATTER(out, at, s.source.direction.x);
  SCATTER(out, at + n, s.source.direction.y);
  SCATTER(out, at + 2 * n, s.source.direction.z);
  SCATTER(out, at + 3 * n, s.distance);
  SCATTER(out, at + 4 * n, SELECT(found, s.pdf, 0.0f));
  SCATTER(out, at + 5 * n, s.rgb[0]);
}
