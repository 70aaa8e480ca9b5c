/* Orthonormal frame about a unit vector n, without branches or singularities.
 *   Duff et al. 2017, "Building an orthonormal basis, revisited", JCGT 6(1) */
#ifndef ITN_FRAME_H
#define ITN_FRAME_H
#include "lib/vector.h"

typedef struct {
  REAL3 s, t, n;
} Frame;

inline Frame make_frame(REAL3 n) {
  Frame f;
  REAL sign = SELECT(n.z >= 0.0f, 1.0f, -1.0f);
  REAL a = -1.0f / (sign + n.z), b = n.x * n.y * a;
  f.s = make3(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x);
  f.t = make3(b, sign + n.y * n.y * a, -n.y);
  f.n = n;
  return f;
}
inline REAL3 frame_to_world(const Frame* f, REAL3 w) {
  return add3(add3(scale3(f->s, w.x), scale3(f->t, w.y)), scale3(f->n, w.z));
}
inline REAL3 frame_to_local(const Frame* f, REAL3 w) { return make3(dot3(f->s, w), dot3(f->t, w), dot3(f->n, w)); }

#endif
