/* Stage ray: from a point in vacuum to the next surface, or out of the scene. */
#ifndef ITN_STAGE_RAY_H
#define ITN_STAGE_RAY_H
#include "path/launch.h"

/* The path has changed its direction here, with LAST_PDF divided by `divisor`. */
INLINE void begin_segment(Pool* pool, INT slots, REAL3 position, REAL divisor, MASK mask) {
#if HAS_AREA_LIGHTS && LIGHT_SAMPLING
  store3(pool, ORIGIN, slots, select3(mask, position, load3(pool, ORIGIN, slots)));
#if ROUGH_LIGHT_SAMPLING
  STORE(pool, LAST_PDF_DIVISOR, slots, SELECT(mask, divisor, LOAD(pool, LAST_PDF_DIVISOR, slots)));
#endif
#endif
}

#if HAS_FAR_CLIP
/* The distance up to which a ray sees that has just left the camera; others see without end. */
INLINE REAL ray_end(const Launch* launch, __global const JobRecord* job, REAL3 direction, MASK first) {
  __global const float* clip = launch->cameras[job->camera].clip;
  return SELECT(first,
                1.0f / MAX(direction.x * clip[0] + direction.y * clip[1] + direction.z * clip[2], (REAL)(1e-30f)),
                INFINITY);
}
#endif

/* Stores where the rays have led. */
INLINE void arrive(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid,
                   const LaneHits* hits) {
  MASK hit = valid & (hits->primitive.integer >= 0);
#if HAS_FAR_CLIP
  const MASK first = LOAD_INT(pool, SKIP, slots) < 0;
  hit = hit & !(hits->distance.real > ray_end(launch, job, load3(pool, DIRECTION, slots), first));
#endif
  store3(pool, POSITION, slots, make3(hits->x.real, hits->y.real, hits->z.real));
  STORE_INT(pool, HIT, slots, hits->primitive.integer);
  STORE(pool, HIT_PLACE, slots, hits->u.real);
  STORE(pool, HIT_PLACE + 1, slots, hits->v.real);
  push_surface(launch, job, pool, slots, hit, hits->primitive.integer);
  push(pool, QUEUE_ESCAPE, slots, valid & !hit);
}

INLINE void ray_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  const INT skip = LOAD_INT(pool, SKIP, slots);
  const LaneHits hits =
      trace_lanes(job_surfaces(launch, job), load3(pool, POSITION, slots), load3(pool, DIRECTION, slots),
                  (REAL)(INFINITY), skip, (MASK)(0), (skip >= 0) & (LOAD_INT(pool, PASSED, slots) != 0), valid);
  arrive(launch, job, pool, slots, valid, &hits);
}

#endif
