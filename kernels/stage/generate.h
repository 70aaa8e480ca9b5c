/* Stage generate: camera rays. The position on the film is drawn from the reconstruction filter, so that every sample
 * of a pixel has weight 1 and belongs to that pixel alone (filter importance sampling; Ernst, Stamminger, Greiner
 * 2006). */
#ifndef ITN_STAGE_GENERATE_H
#define ITN_STAGE_GENERATE_H
#include "path/event_random.h"
#include "derivative/adjoint.h"
#include "light/connection.h"
#include "model/sensor/opencv.h"
#include "path/film_filter.h"
#include "geometry/frame.h"
#include "path/launch.h"
#include "geometry/surface_point.h"
#include "geometry/trace_coherent.h"
#include "stage/ray.h"

/* v0 + a va + b vb: see CameraRecord. */
INLINE REAL3 on_camera(__global const float* v0, __global const float* va, __global const float* vb, REAL a, REAL b) {
  return make3(v0[0] + a * va[0] + b * vb[0], v0[1] + a * va[1] + b * vb[1], v0[2] + a * va[2] + b * vb[2]);
}

#if HAS_DISTORTION
/* The film position at which the camera would see the same without its distortion. */
INLINE void undistort(__global const CameraRecord* camera, REAL* a, REAL* b) {
  if (camera->slope_a == 0.0f) return;
  REAL k[8], x, y;
  UNROLL_FOR(int i = 0; i < 8; ++i) k[i] = (REAL)(camera->distortion[i]);
  opencv_undistort(k, (camera->middle_a - *a) * camera->slope_a, (camera->middle_b - *b) * camera->slope_b, &x, &y);
  *a = camera->middle_a - x / camera->slope_a;
  *b = camera->middle_b - y / camera->slope_b;
}
#endif

/* The ray of a film position; *weight: what its radiance counts; *normal: of the surface on which the sensor lies. */
INLINE void camera_ray(const Launch* launch, __global const CameraRecord* camera, const Random* random, REAL a, REAL b,
                       REAL3* origin, REAL3* direction, REAL* weight, REAL3* normal) {
#if HAS_DISTORTION
  undistort(camera, &a, &b);
#endif
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
  sample_surface(launch->light_tables, (INT)(camera->table), (INT)(camera->surfaces), u[0], u[1], u[2], origin, normal);
  if (camera->measures) {
    REAL v[4];
    draw(random, 2, v);
    const Frame frame = make_frame(*normal);
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

#if HAS_METERED_LIGHTS
/* Lights without extent, which no path meets, shine on a sensor that measures irradiance straight, through index-matched
 * boundaries and media. Other light the sensor's paths find. */
INLINE void connect_meter(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid,
                          const Random* random, INT medium, REAL3 from, REAL3 normal) {
  if (job->lights == 0 || job->hide_emitters || job->max_depth == 0) return;
  REAL u[4], weight[RADIANCE_CHANNELS];
  draw(random, 3, u);
  LightSample light;
  const MASK found = valid & sample_light_of_scene(launch, job, 1.0f, from, u, u[2], &light);
  const REAL cosine = dot3(normal, light.source.direction);
  const MASK lit = found & (light.by_chance == 0.0f) & (cosine > 0.0f);
  if (!ANY(lit)) return;
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) weight[c] = cosine / SELECT(lit, light.pdf, 1.0f);
  const Scores scores = load_scores(job, pool, slots);
  const ConnectionStart start = connection_start(lit);
  add_connection(launch, job, pool, slots, random, lit, from, &light, (INT)(-1), medium, weight, &scores, &start);
}
#endif

/* Paths that are traced again for their probes (scattering/probe.h): those without one are done. Returns the others. */
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

/* Computes where on the film the sample of a pixel lies: see CameraRecord. */
INLINE void film_position(__global const CameraRecord* camera, INT pixel, const REAL u[4], REAL* a, REAL* b) {
  Lanes p, row, column;
  p.integer = pixel;
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) {
    row.i[l] = p.i[l] / camera->crop_width;
    column.i[l] = p.i[l] - row.i[l] * camera->crop_width;
  }
  REAL dx, dy;
  sample_filter(camera->filter, camera->filter_size, u[0], u[1], &dx, &dy);
#if HAS_FILM_EDGES
  stay_on_film(camera, column.integer, row.integer, u[0], u[1], &dx, &dy);
#endif
  REAL x = CAST_REAL(column.integer + camera->crop_x) + 0.5f + dx;
  REAL y = CAST_REAL(row.integer + camera->crop_y) + 0.5f + dy;
  *a = 1.0f - 2.0f * x * camera->inverse_width;
  *b = 1.0f - 2.0f * y * camera->inverse_height;
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
  REAL a, b;
  film_position(camera, pixel, u, &a, &b);
  REAL3 o, d;
  REAL3 normal = make3((REAL)(0.0f), (REAL)(0.0f), (REAL)(1.0f));
  REAL weight;
  camera_ray(launch, camera, &random, a, b, &o, &d, &weight, &normal);
  store3(pool, POSITION, slots, o);
  d = scale3(d, 1.0f / SQRT(dot3(d, d)));
  store3(pool, DIRECTION, slots, d);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) STORE(pool, THROUGHPUT + c, slots, 1.0f);
  UNROLL_FOR(int c = RADIANCE; c < REFRACTION_SCALE; ++c) STORE(pool, c, slots, 0.0f); /* derivatives and scores too */
  if (job->max_depth == 0) weight = (REAL)(0.0f); /* emitters are not shown either, as in Mitsuba */
  STORE(pool, REFRACTION_SCALE, slots, weight);   /* roulette does not see it */
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
#if HAS_METERED_LIGHTS && !OPERATOR_SINGLE
  if (camera->measures) connect_meter(launch, job, pool, slots, valid, &random, (INT)(camera->medium), o, normal);
#endif
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
