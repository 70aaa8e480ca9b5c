// Runs the functions of kernels/texture/field.h along one way: one work-item a group of WIDTH lanes, whose samples are
// numbers from 0 on; arrays hold one component after another. out: distance of the flight, the hero's channel, spectral
// weights after it, those of the scattering included; transmittance, column density, and the field where the way
// begins, three channels each.
#include "path/event_random.h"
#include "path/spectral.h"
#include "texture/field.h"

__kernel void follow(__global const FieldRecord* fields, __global const float* voxels, float x, float y, float z,
                     float dx, float dy, float dz, float distance, float s0, float s1, float s2, uint seed,
                     __global float* out) {
  const int n = (int)get_global_size(0) * WIDTH;
  const INT at = LANE_INDEX + (int)get_global_id(0) * WIDTH;
  Launch launch;
  launch.fields = fields;
  launch.voxels = voxels;
  const REAL3 from = make3((REAL)(x), (REAL)(y), (REAL)(z)), direction = make3((REAL)(dx), (REAL)(dy), (REAL)(dz));
  const REAL sigma_t[3] = {(REAL)(s0), (REAL)(s1), (REAL)(s2)};
  Random random;
  random.pixel = (UINT)(0u);
  random.sample = AS_UINT(at);
  random.event = (INT)(3);
  random.seed_low = seed;
  random.seed_high = 0;
  REAL u[4], weight[3], there[FIELD_CHANNELS], through[THROUGHPUT_CHANNELS], column_density[FIELD_CHANNELS];
  REAL value[FIELD_CHANNELS];
  draw(&random, 0, u);
  const INT hero = SPECTRAL ? CAST_INT(u[0] * 3.0f) : (INT)(0);
  const MASK all = (MASK)(-1);
  weight[0] = weight[1] = weight[2] = (REAL)(1.0f);
  const REAL flight =
      field_flight(&launch, fields, &random, from, direction, (REAL)(distance), sigma_t, hero, all, weight, there);
#if SPECTRAL
  REAL factor[3];
  for (int c = 0; c < 3; ++c) factor[c] = sigma_t[c] * there[FIELD_CHANNELS == 3 ? c : 0];
  spectral_event(flight < ENDLESS, factor, weight);
#endif
  for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) through[c] = (REAL)(1.0f);
  for (int c = 0; c < FIELD_CHANNELS; ++c) column_density[c] = (REAL)(0.0f);
  field_transmittance(&launch, fields, &random, 0, from, direction, (REAL)(distance), sigma_t, all, through);
  field_column_density(&launch, fields, from, direction, (REAL)(distance), u[1], all, column_density);
  field_value(&launch, fields, from, FIELD_CHANNELS, value);
  SCATTER(out, at, flight);
  SCATTER(out, at + n, CAST_REAL(hero));
  for (int c = 0; c < 3; ++c) {
    SCATTER(out, at + (2 + c) * n, weight[c]);
    SCATTER(out, at + (5 + c) * n, through[THROUGHPUT_CHANNELS == 3 ? c : 0]);
    SCATTER(out, at + (8 + c) * n, column_density[FIELD_CHANNELS == 3 ? c : 0]);
    SCATTER(out, at + (11 + c) * n, value[FIELD_CHANNELS == 3 ? c : 0]);
  }
}
