/* An orthonormal frame around a unit vector n, without branches.
 *   Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin 2017, "Building an orthonormal basis, revisited"
 * Tests: tests/model/shading_frame_test.cpp */
#ifndef ITN_SHADING_FRAME_H
#define ITN_SHADING_FRAME_H
#include "shared/portable.h"

/* s, t, n right-handed. */
MODEL_VOID shading_frame(REAL3 n, REAL3* s, REAL3* t) {
  REAL sign = SELECT(n.z < NUMBER(0), NUMBER(-1), NUMBER(1));
  REAL a = NUMBER(-1) / (sign + n.z);
  REAL b = n.x * n.y * a;
  *s = make3(NUMBER(1) + sign * n.x * n.x * a, sign * b, -sign * n.x);
  *t = make3(b, sign + n.y * n.y * a, -n.y);
}

MODEL3 to_local(REAL3 s, REAL3 t, REAL3 n, REAL3 v) { return make3(dot3(s, v), dot3(t, v), dot3(n, v)); }

MODEL3 to_world(REAL3 s, REAL3 t, REAL3 n, REAL3 v) {
  return add3(add3(scale3(s, v.x), scale3(t, v.y)), scale3(n, v.z));
}

#endif
