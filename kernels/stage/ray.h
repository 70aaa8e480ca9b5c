/* Stage ray: from a point in vacuum to the next surface, or out of the scene. */
#ifndef ITN_STAGE_RAY_H
#define ITN_STAGE_RAY_H
#include "lib/launch.h"

/* Traces the lanes in `mask`; others get primitive -1. */
inline void trace_lanes(const Launch* launch, __global const JobRecord* job, REAL3 o, REAL3 d, REAL t_max, INT skip,
                        int inside, MASK mask, Lanes* distance, Lanes* primitive, Lanes* u, Lanes* v) {
  Lanes ox, oy, oz, dx, dy, dz, far, from;
  ox.real = o.x;
  oy.real = o.y;
  oz.real = o.z;
  dx.real = d.x;
  dy.real = d.y;
  dz.real = d.z;
  far.real = t_max;
  from.integer = skip;
  distance->real = t_max;
  primitive->integer = (INT)(-1);
  u->real = (REAL)(0.0f);
  v->real = (REAL)(0.0f);
  uint bits = lane_bits(mask);
  FOR_EACH_LANE(l, bits) {
    Hit hit = trace(launch->nodes, launch->leaves, launch->geometries + job->geometry, ox.f[l], oy.f[l], oz.f[l],
                    dx.f[l], dy.f[l], dz.f[l], far.f[l], from.i[l], inside);
    primitive->i[l] = hit.primitive;
    if (hit.primitive >= 0) {
      distance->f[l] = hit.t;
      u->f[l] = hit.u;
      v->f[l] = hit.v;
    }
  }
}

inline void ray_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  REAL3 o = load3(pool, POSITION_X, slots), d = load3(pool, DIRECTION_X, slots);
  Lanes t, primitive, u, v;
  trace_lanes(launch, job, o, d, (REAL)(INFINITY), LOAD_INT(pool, SKIP, slots), 0, valid, &t, &primitive, &u, &v);
  MASK hit = valid & (primitive.integer >= 0);
  REAL distance = SELECT(hit, t.real, 0.0f);
  store3(pool, POSITION_X, slots, add3(o, scale3(d, distance)));
  STORE_INT(pool, HIT, slots, primitive.integer);
  STORE(pool, HIT_U, slots, u.real);
  STORE(pool, HIT_V, slots, v.real);
  push_surface(launch, job, pool, slots, hit, primitive.integer);
  push(pool, QUEUE_ESCAPE, slots, valid & !hit);
}

#endif
