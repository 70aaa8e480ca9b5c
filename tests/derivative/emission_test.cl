// Runs kernels/light/emission.h alone: one work-item a group of WIDTH lanes; arrays hold one component after another.
#include "light/emission.h"
#include "light/environment.h"
#include "light/light_sampling.h"

// out: radiance of the first record, then its derivative along the second.
__kernel void differentiate(__global const EnvironmentRecord* records, __global const float* tables,
                            __global const float* direction, __global float* out) {
  const int n = (int)get_global_size(0) * WIDTH;
  const INT at = LANE_INDEX + (int)get_global_id(0) * WIDTH;
  const REAL3 d = make3(GATHER(direction, at), GATHER(direction, at + n), GATHER(direction, at + 2 * n));
  REAL radiance[3], derivative[3];
  environment_radiance(records, tables, d, radiance);
  environment_derivative(records, records + 1, tables, d, derivative);
  for (int c = 0; c < 3; ++c) {
    SCATTER(out, at + c * n, radiance[c]);
    SCATTER(out, at + (3 + c) * n, derivative[c]);
  }
}
