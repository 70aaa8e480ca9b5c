/* Mitsuba's `twosided`: the BSDF inside on both sides, mirrored (branch 0); or one on the front (1) and another on the back,
 * mirrored (2). */
#ifndef ITN_NEST_TWOSIDED_H
#define ITN_NEST_TWOSIDED_H
#include "model/nest/nest.h"
#include "model/obstacle.h"

#define TWOSIDED_NUMBERS(NUMBER)
#define TWOSIDED_PARAMETERS(PARAMETER)
#define TWOSIDED_TRAITS 0
enum { TWOSIDED_NUMBERS(DECLARE_SLOT) TWOSIDED_SLOTS };

MODEL_VOID twosided_enter(int branch, const REAL* n, REAL3 wi, REAL3 wo, NEST* x) {
  MASK back = dot3(x->z, wi) < NUMBER(0);
  if (branch == 1) x->share = SELECT(back, NUMBER(0), x->share);
  if (branch == 2) x->share = SELECT(back, x->share, NUMBER(0));
  if (branch != 1) x->z = scale3(x->z, SELECT(back, NUMBER(-1), NUMBER(1)));
}

#ifndef __OPENCL_VERSION__
MODEL_VOID twosided_numbers(const REAL*, REAL*) {}
inline const char* twosided_obstacle(const double*, int) { return differentiable; }
#endif

#endif
