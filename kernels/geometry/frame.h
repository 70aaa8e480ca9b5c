/* A frame around a unit vector, kept together. OpenCL C only. */
#ifndef ITN_FRAME_H
#define ITN_FRAME_H
#include "shared/vector.h"
#include "model/shading_frame.h"

typedef struct {
  REAL3 s, t, n;
} Frame;

INLINE Frame make_frame(REAL3 n) {
  Frame f;
  shading_frame(n, &f.s, &f.t);
  f.n = n;
  return f;
}
/* With s along what of `tangent` lies in the plane; n: unit. */
INLINE Frame make_frame_along(REAL3 n, REAL3 tangent) {
  Frame f = make_frame(n);
  const REAL3 in_plane = sub3(tangent, scale3(n, dot3(n, tangent)));
  const REAL length2 = dot3(in_plane, in_plane);
  f.s = select3(length2 > 0.0f, scale3(in_plane, 1.0f / SQRT(MAX(length2, (REAL)(1e-30f)))), f.s);
  f.t = cross3(n, f.s);
  return f;
}
INLINE REAL3 frame_to_world(const Frame* f, REAL3 w) { return to_world(f->s, f->t, f->n, w); }
INLINE REAL3 frame_to_local(const Frame* f, REAL3 w) { return to_local(f->s, f->t, f->n, w); }

#endif
