/* Stage generate: camera rays. The position on the film is drawn from the reconstruction filter, so that every sample
 * of a pixel has weight 1 and belongs to that pixel alone (filter importance sampling; Ernst, Stamminger, Greiner
 * 2006). */
#ifndef ITN_STAGE_GENERATE_H
#define ITN_STAGE_GENERATE_H
#include "lib/adjoint.h"
#include "lib/launch.h"
#include "lib/trace_coherent.h"
#include "stage/ray.h"

/* Offset from the pixel's centre [pixel]. */
inline void sample_filter(int filter, float size, REAL u, REAL v, REAL* x, REAL* y) {
  if (filter == FILTER_GAUSSIAN) { /* cut at four standard deviations: exp(-8) */
    REAL radius = size * SQRT(-2.0f * LOG((REAL)3.3546e-4f + (REAL)0.99966454f * u));
    REAL s, c;
    sin_cos_2pi(v, &s, &c);
    *x = radius * c;
    *y = radius * s;
  } else if (filter == FILTER_TENT) {
    *x = size * SELECT(u < 0.5f, SQRT(2.0f * u) - 1.0f, 1.0f - SQRT(MAX((REAL)0.0f, 2.0f - 2.0f * u)));
    *y = size * SELECT(v < 0.5f, SQRT(2.0f * v) - 1.0f, 1.0f - SQRT(MAX((REAL)0.0f, 2.0f - 2.0f * v)));
  } else {
    *x = u - 0.5f;
    *y = v - 0.5f;
  }
}

/* v0 + a va + b vb: see CameraRecord. */
inline REAL3 on_camera(__global const float* v0, __global const float* va, __global const float* vb, REAL a, REAL b) {
  return make3(v0[0] + a * va[0] + b * vb[0], v0[1] + a * va[1] + b * vb[1], v0[2] + a * va[2] + b * vb[2]);
}

inline void generate_stage(const Launch* launch, int job_index, Pool* pool, INT slots, MASK valid, INT pixel,
                           INT sample) {
  __global const JobRecord* job = launch->jobs + job_index;
  __global const CameraRecord* camera = launch->cameras + job->camera;
  Random random;
  random.pixel = AS_UINT(pixel);
  random.sample = AS_UINT(sample);
  random.event = (INT)(0);
  random.seed_low = job->seed_low;
  random.seed_high = job->seed_high;
  REAL u[4];
  draw(&random, 0, u);
  Lanes p, row, column;
  p.integer = pixel;
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) {
    row.i[l] = p.i[l] / camera->crop_width;
    column.i[l] = p.i[l] - row.i[l] * camera->crop_width;
  }
  REAL dx, dy;
  sample_filter(camera->filter, camera->filter_size, u[0], u[1], &dx, &dy);
  REAL x = CAST_REAL(column.integer + camera->crop_x) + 0.5f + dx;
  REAL y = CAST_REAL(row.integer + camera->crop_y) + 0.5f + dy;
  REAL a = 1.0f - 2.0f * x * camera->inverse_width, b = 1.0f - 2.0f * y * camera->inverse_height;
  const REAL3 o = on_camera(camera->origin_0, camera->origin_a, camera->origin_b, a, b);
  REAL3 d = on_camera(camera->direction_0, camera->direction_a, camera->direction_b, a, b);
  store3(pool, POSITION, slots, o);
  d = scale3(d, 1.0f / SQRT(dot3(d, d)));
  store3(pool, DIRECTION, slots, d);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) STORE(pool, THROUGHPUT + c, slots, 1.0f);
  UNROLL_FOR(int c = RADIANCE; c < REFRACTION_SCALE; ++c) STORE(pool, c, slots, 0.0f); /* derivatives and scores too */
  STORE(pool, REFRACTION_SCALE, slots, 1.0f);
  STORE_INT(pool, PIXEL, slots, pixel);
  STORE_INT(pool, SAMPLE, slots, sample);
  STORE_INT(pool, EVENT, slots, 1);
  STORE_INT(pool, DEPTH, slots, 0);
  STORE_INT(pool, MEDIUM, slots, camera->medium);
  STORE_INT(pool, SKIP, slots, -1);
  STORE_INT(pool, PASSED, slots, 0);
  STORE(pool, LAST_PDF, slots, 0.0f);
  STORE_INT(pool, JOB, slots, job_index);
#if SPECTRAL
  UNROLL_FOR(int c = 0; c < 3; ++c) STORE(pool, SPECTRAL_WEIGHT + c, slots, 1.0f);
  STORE_INT(pool, HERO, slots, CAST_INT(u[2] * 3.0f));
#endif
  begin_segment(pool, slots, o, (REAL)(1.0f), (MASK)(-1));
  begin_replay(launch, job, pool, slots, valid, pixel, sample);
#if FUSED && WIDTH == BOX_WIDTH && !HAS_ROUND
  /* Samples of a pixel come together here. */
  LaneHits hits;
  if (camera->medium < 0 && trace_coherent(job_surfaces(launch, job), o, d, valid, &hits)) {
    arrive(launch, job, pool, slots, valid, &hits);
    return;
  }
#endif
  push(pool, camera->medium < 0 ? QUEUE_RAY : QUEUE_MEDIUM, slots, valid);
}

#endif
