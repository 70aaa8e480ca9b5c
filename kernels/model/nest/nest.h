/* Elements that XML nests around BSDFs are flattened into structures: leaves, which are BSDFs, and on the way to
 * each the nests around it, outermost first. A Nest is what they make of the surface for one leaf: the frame in which
 * the leaf sees directions, and its part of the light.
 *
 *   f |cos wo| = sum over leaves of share seen lit f_leaf(wi', wo') |cos wo'|,   density = sum of share seen density_leaf
 *
 * with wi', wo' in the leaf's frame. share: the probability with which the leaf is picked, of wi alone, 1 in sum. seen: 1, or
 * 0 where wi and wo are no directions of the leaf. lit: a factor of its value alone.
 * Tests: tests/model/structure_test.cpp */
#ifndef ITN_NEST_H
#define ITN_NEST_H
#include "shared/declaration.h"

#ifdef __OPENCL_VERSION__
typedef struct {
  REAL3 s, t, z; /* axes of the leaf's frame, in that of the surface */
  REAL share, seen, lit;
} Nest;
#define NEST Nest
#define MODEL_NEST static inline Nest
#else
template <class Real>
struct Nest {
  Vector3<Real> s, t, z;
  Real share, seen, lit;
};
#define NEST Nest<REAL>
#define MODEL_NEST      \
  template <class REAL> \
  inline Nest<REAL>
#endif

/* The surface itself. wi gives the kind of number. */
MODEL_NEST nest_begin(REAL3 wi) {
  NEST x;
  x.s = make3(NUMBER(1), NUMBER(0), NUMBER(0));
  x.t = make3(NUMBER(0), NUMBER(1), NUMBER(0));
  x.z = make3(NUMBER(0), NUMBER(0), NUMBER(1));
  x.share = NUMBER(1);
  x.seen = NUMBER(1);
  x.lit = NUMBER(1);
  return x;
}

MODEL3 nest_local(const NEST* x, REAL3 w) { return make3(dot3(x->s, w), dot3(x->t, w), dot3(x->z, w)); }

MODEL3 nest_world(const NEST* x, REAL3 w) {
  return add3(add3(scale3(x->s, w.x), scale3(x->t, w.y)), scale3(x->z, w.z));
}

/* The leaf itself, of which light is seen on its upper side alone. */
MODEL_VOID nest_opaque(REAL3 wi, NEST* x) { x->seen = SELECT(dot3(x->z, wi) > NUMBER(0), x->seen, NUMBER(0)); }

#endif
