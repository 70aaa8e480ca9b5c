/* A frame around a unit vector, kept together. OpenCL C only. */
#ifndef ITN_FRAME_H
#define ITN_FRAME_H
#include "lib/vector.h"
#include "model/shading_frame.h"

typedef struct {
  REAL3 s, t, n;
} Frame;

inline Frame make_frame(REAL3 n) {
  Frame f;
  shading_frame(n, &f.s, &f.t);
  f.n = n;
  return f;
}
inline REAL3 frame_to_world(const Frame* f, REAL3 w) { return to_world(f->s, f->t, f->n, w); }
inline REAL3 frame_to_local(const Frame* f, REAL3 w) { return to_local(f->s, f->t, f->n, w); }

#endif
