// Runs kernels/light/environment.h alone: one work-item a group of WIDTH lanes; arrays hold one component after
// another.
#include "light/environment.h"
#include "light/sun.h"
#include "shared/vector.h"

#if WIDTH == 1
#define LOAD(p, at) p[at]
#define STORE(p, at, v) p[at] = v
#else
#define LOAD(p, at) JOIN(vload, WIDTH)(0, p + at)
#define STORE(p, at, v) JOIN(vstore, WIDTH)(v, 0, p + at)
#endif

__kernel void evaluate(__global const EnvironmentRecord* record, __global const float* tables,
                       __global const float* direction, __global float* out) {
  const size_t n = get_global_size(0) * WIDTH, at = get_global_id(0) * WIDTH;
  REAL3 d;
  d.x = LOAD(direction, at);
  d.y = LOAD(direction, at + n);
  d.z = LOAD(direction, at + 2 * n);
  REAL sky[3], sun[3];
  smooth_radiance(record, tables, d, sky);
  const MASK inside = sun_radiance(record, tables, d, sun);
  const REAL pdf = smooth_pdf(record, tables, d);
  for (int c = 0; c < 3; ++c) {
    STORE(out, at + c * n, sky[c]);
    STORE(out, at + (3 + c) * n, sun[c]);
  }
  STORE(out, at + 6 * n, pdf);
  STORE(out, at + 7 * n, SELECT(inside, 1, 0) + SELECT(in_sun(record, d), 2, 0));
}

__kernel void sample(__global const EnvironmentRecord* record, __global const float* tables, __global const float* u,
                     __global float* out, int of_sun) {
  const size_t n = get_global_size(0) * WIDTH, at = get_global_id(0) * WIDTH;
  const REAL u0 = LOAD(u, at), u1 = LOAD(u, at + n);
  REAL3 d;
  REAL pdf, rgb[3];
  if (of_sun) {
    sun_sample(record, tables, u0, u1, &d, rgb);
    pdf = record->sun_pdf;
  } else {
    d = smooth_sample(record, tables, u0, u1, &pdf);
    smooth_radiance(record, tables, d, rgb);
  }
  STORE(out, at, d.x);
  STORE(out, at + n, d.y);
  STORE(out, at + 2 * n, d.z);
  for (int c = 0; c < 3; ++c) STORE(out, at + (3 + c) * n, rgb[c]);
  STORE(out, at + 6 * n, pdf);
}
