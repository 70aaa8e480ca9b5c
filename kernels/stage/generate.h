/* Stage generate: camera rays. The position on the film is drawn from the reconstruction filter, so that every sample
 * of a pixel has weight 1 and belongs to that pixel alone (filter importance sampling; Ernst, Stamminger, Greiner
 * 2006). */
#ifndef ITN_STAGE_GENERATE_H
#define ITN_STAGE_GENERATE_H
#include "lib/adjoint.h"
#include "lib/frame.h"
#include "lib/launch.h"
#include "lib/surface_point.h"
#include "lib/trace_coherent.h"
#include "stage/ray.h"

/* Offset from the pixel's centre [pixel]. */
INLINE void sample_filter(int filter, float size, REAL u, REAL v, REAL* x, REAL* y) {
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
INLINE REAL3 on_camera(__global const float* v0, __global const float* va, __global const float* vb, REAL a, REAL b) {
  return make3(v0[0] + a * va[0] + b * vb[0], v0[1] + a * va[1] + b * vb[1], v0[2] + a * va[2] + b * vb[2]);
}

/* The ray of a film position; *weight: what its radiance counts. */
INLINE void camera_ray(const Launch* launch, __global const CameraRecord* camera, const Random* random, REAL a, REAL b,
                       REAL3* origin, REAL3* direction, REAL* weight) {
  *origin = on_camera(camera->origin_0, camera->origin_a, camera->origin_b, a, b);
  *direction = on_camera(camera->direction_0, camera->direction_a, camera->direction_b, a, b);
  *weight = (REAL)(1.0f);
#if HAS_LENS || HAS_ZONE
  REAL u[4];
  draw(random, 1, u);
#endif
#if HAS_LENS
  const REAL radius = SQRT(u[0]);
  REAL sine, cosine;
  sin_cos_2pi(u[1], &sine, &cosine);
  __global const float *la = camera->lens_a, *lb = camera->lens_b;
  const REAL x = radius * cosine, y = radius * sine;
  const REAL3 lens = make3(x * la[0] + y * lb[0], x * la[1] + y * lb[1], x * la[2] + y * lb[2]);
  *origin = add3(*origin, scale3(lens, camera->lens_start));
  *direction = sub3(*direction, scale3(lens, camera->lens_turn));
#endif
#if HAS_ZONE
  if (camera->surfaces == 0) return;
  REAL3 normal;
  sample_surface(launch->light_tables, (INT)(camera->table), (INT)(camera->surfaces), u[0], u[1], u[2], origin,
                 &normal);
  if (camera->measures) {
    REAL v[4];
    draw(random, 2, v);
    const Frame frame = make_frame(normal);
    const REAL across = SQRT(v[0]);
    REAL sine_across, cosine_across;
    sin_cos_2pi(v[1], &sine_across, &cosine_across);
    *direction = frame_to_world(&frame, make3(across * cosine_across, across * sine_across, SQRT(1.0f - v[0])));
    *weight = (REAL)((float)PI_);
  } else {
    __global const float* before = camera->before;
    *origin = make3(origin->x - before[0], origin->y - before[1], origin->z - before[2]);
  }
#endif
}

/* Paths that are traced again for their probes (lib/probe.h): those without one are done. Returns the others. */
INLINE MASK keep_probes(__global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
#if VOXEL_SUMS
  if (job->replay != REPLAY_PROBES) return valid;
  const MASK idle = valid & !(LOAD(pool, PROBE_TARGET, slots) < INFINITY);
  push(pool, QUEUE_FREE, slots, idle);
  return valid & !idle;
#else
  return valid;
#endif
}

INLINE void generate_stage(const Launch* launch, int job_index, Pool* pool, INT slots, MASK valid, INT pixel,
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
  REAL3 o, d;
  REAL weight;
  camera_ray(launch, camera, &random, a, b, &o, &d, &weight);
  store3(pool, POSITION, slots, o);
  d = scale3(d, 1.0f / SQRT(dot3(d, d)));
  store3(pool, DIRECTION, slots, d);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) STORE(pool, THROUGHPUT + c, slots, 1.0f);
  UNROLL_FOR(int c = RADIANCE; c < REFRACTION_SCALE; ++c) STORE(pool, c, slots, 0.0f); /* derivatives and scores too */
  STORE(pool, REFRACTION_SCALE, slots, weight);                                        /* roulette does not see it */
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
  valid = keep_probes(job, pool, slots, valid);
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
