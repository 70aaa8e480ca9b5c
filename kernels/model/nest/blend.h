/* Mitsuba's `blendbsdf`: (1 - weight) of the first BSDF inside and weight of the second. */
#ifndef ITN_NEST_BLEND_H
#define ITN_NEST_BLEND_H
#include "model/nest/nest.h"
#include "model/obstacle.h"

#define BLEND_NUMBERS(NUMBER) NUMBER(BLEND, weight, 1, ROLE_FACTOR, COORDINATE_ITSELF)
#define BLEND_PARAMETERS(PARAMETER) PARAMETER(weight, SHARE, -1, "")
#define BLEND_TRAITS 0
enum { BLEND_NUMBERS(DECLARE_SLOT) BLEND_SLOTS };

MODEL_VOID blend_enter(int branch, const REAL* n, REAL3 wi, REAL3 wo, NEST* x) {
  x->share = x->share * (branch == 0 ? NUMBER(1) - n[BLEND_weight] : n[BLEND_weight]);
}

#ifndef __OPENCL_VERSION__
MODEL_VOID blend_numbers(const REAL* parameters, REAL* n) { n[BLEND_weight] = parameters[0]; }
/* At 0 and 1 one of the two is not there: paths that would show its part are not sampled. */
inline const char* blend_obstacle(const double* parameters, int) {
  return parameters[0] > 0 && parameters[0] < 1
             ? differentiable
             : "at 0 or 1 one of the two is not sampled; start from between them, such as 0.01";
}
#endif

#endif
