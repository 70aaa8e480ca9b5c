/* Stage ray: from a point in vacuum to the next surface, or out of the scene. */
#ifndef ITN_STAGE_RAY_H
#define ITN_STAGE_RAY_H
#include "lib/launch.h"

typedef struct {
  Lanes distance, primitive, u, v, x, y, z; /* as in Hit */
} LaneHits;

/* Traces the lanes in `mask`; others get primitive -1. inside, strict: as in trace_onward. */
inline LaneHits trace_lanes(const Launch* launch, __global const JobRecord* job, REAL3 o, REAL3 d, REAL t_max, INT skip,
                            bool inside, MASK strict, MASK mask) {
  const Surfaces surfaces =
      surfaces_of(launch->nodes, launch->leaves, launch->primitives, launch->geometries + job->geometry);
  LaneHits hits;
  Lanes dx, dy, dz, from, onward;
  hits.x.real = o.x;
  hits.y.real = o.y;
  hits.z.real = o.z;
  dx.real = d.x;
  dy.real = d.y;
  dz.real = d.z;
  from.integer = skip;
  onward.integer = strict;
  hits.distance.real = t_max;
  hits.primitive.integer = (INT)(-1);
  hits.u.real = (REAL)(0.0f);
  hits.v.real = (REAL)(0.0f);
  uint bits = lane_bits(mask);
  FOR_EACH_LANE(l, bits) {
    const Hit hit = trace_onward(surfaces, hits.x.f[l], hits.y.f[l], hits.z.f[l], dx.f[l], dy.f[l], dz.f[l],
                                 hits.distance.f[l], from.i[l], inside, onward.i[l]);
    if (hit.primitive < 0) continue;
    hits.primitive.i[l] = hit.primitive;
    hits.distance.f[l] = hit.t;
    hits.u.f[l] = hit.u;
    hits.v.f[l] = hit.v;
    hits.x.f[l] = hit.x;
    hits.y.f[l] = hit.y;
    hits.z.f[l] = hit.z;
  }
  return hits;
}

inline void ray_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  const INT skip = LOAD_INT(pool, SKIP, slots);
  const LaneHits hits =
      trace_lanes(launch, job, load3(pool, POSITION_X, slots), load3(pool, DIRECTION_X, slots), (REAL)(INFINITY), skip,
                  false, (skip >= 0) & (LOAD_INT(pool, PASSED, slots) != 0), valid);
  const MASK hit = valid & (hits.primitive.integer >= 0);
  store3(pool, POSITION_X, slots, make3(hits.x.real, hits.y.real, hits.z.real));
  STORE_INT(pool, HIT, slots, hits.primitive.integer);
  STORE(pool, HIT_U, slots, hits.u.real);
  STORE(pool, HIT_V, slots, hits.v.real);
  push_surface(launch, job, pool, slots, hit, hits.primitive.integer);
  push(pool, QUEUE_ESCAPE, slots, valid & !hit);
}

#endif
