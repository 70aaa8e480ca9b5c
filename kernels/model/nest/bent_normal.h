/* Common code of normal and bump maps: the BSDF inside sees the frame around another normal.
 *   Estevez, Lecocq, Stellato 2019, "A microfacet-based shadowing function to solve the bump terminator problem" */
#ifndef ITN_NEST_BENT_NORMAL_H
#define ITN_NEST_BENT_NORMAL_H
#include "model/nest/nest.h"

/* The square of the tangent of a unit vector's angle with z. */
MODEL squared_tangent(REAL3 w) {
  REAL cos2 = w.z * w.z;
  return MAX(NUMBER(1) - cos2, NUMBER(0)) / MAX(cos2, NUMBER(1e-12));
}

/* The share of the light from wo that reaches a surface that stands for bumps with this normal. */
MODEL bump_shadowing(REAL3 normal, REAL3 wo) {
  REAL alpha2 = MIN(NUMBER(0.125) * squared_tangent(normal), NUMBER(1));
  return NUMBER(2) / (NUMBER(1) + SQRT(NUMBER(1) + alpha2 * squared_tangent(wo)));
}

/* normal: of any length, in the frame of x. flips: 1 turns normals around that wi does not see; shadowed: 1 dims the light
 * that comes in low over them. Directions that are on one side of the surface and on another of the bent one are lost. */
MODEL_VOID bend_normal(REAL3 normal, REAL flips, REAL shadowed, REAL3 wi, REAL3 wo, NEST* x) {
  REAL3 in = nest_local(x, wi), out = nest_local(x, wo);
  REAL turn = SELECT((flips > NUMBER(0)) & (in.z * dot3(in, normal) <= NUMBER(0)), NUMBER(-1), NUMBER(1));
  REAL3 m = make3(turn * normal.x, turn * normal.y, normal.z);
  m = scale3(m, NUMBER(1) / SQRT(MAX(dot3(m, m), NUMBER(1e-20))));
  /* the first axis stays as near as possible to the surface's */
  REAL3 along = sub3(make3(NUMBER(1), NUMBER(0), NUMBER(0)), scale3(m, m.x));
  REAL3 s = scale3(along, NUMBER(1) / SQRT(MAX(dot3(along, along), NUMBER(1e-20))));
  REAL3 t = cross3(m, s);
  x->seen = SELECT(out.z * dot3(m, out) > NUMBER(0), x->seen, NUMBER(0));
  x->lit = x->lit * SELECT(shadowed > NUMBER(0), bump_shadowing(m, out), NUMBER(1));
  REAL3 s_world = nest_world(x, s), t_world = nest_world(x, t), z_world = nest_world(x, m);
  x->s = s_world;
  x->t = t_world;
  x->z = z_world;
}

#endif
