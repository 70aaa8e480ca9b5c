/* Mitsuba's `mask`: the BSDF inside with the probability `opacity` (branch 0), else light passes straight on (branch 1), which
 * is no scattering. */
#ifndef ITN_NEST_OPACITY_MASK_H
#define ITN_NEST_OPACITY_MASK_H
#include "model/nest/nest.h"
#include "model/obstacle.h"

#define OPACITY_MASK_NUMBERS(NUMBER) NUMBER(OPACITY_MASK, opacity, 1, ROLE_FACTOR, COORDINATE_ITSELF)
#define OPACITY_MASK_PARAMETERS(PARAMETER) PARAMETER(opacity, SHARE, 0.5, "")
#define OPACITY_MASK_TRAITS 0
enum { OPACITY_MASK_NUMBERS(DECLARE_SLOT) OPACITY_MASK_SLOTS };

MODEL_VOID opacity_mask_enter(int branch, const REAL* n, REAL3 wi, REAL3 wo, NEST* x) {
  x->share = x->share * (branch == 0 ? n[OPACITY_MASK_opacity] : NUMBER(1) - n[OPACITY_MASK_opacity]);
}

#ifndef __OPENCL_VERSION__
MODEL_VOID opacity_mask_numbers(const REAL* parameters, REAL* n) { n[OPACITY_MASK_opacity] = parameters[0]; }
inline const char* opacity_mask_obstacle(const double* parameters, int) {
  return parameters[0] > 0 && parameters[0] < 1
             ? differentiable
             : "at 0 or 1 one part of the light is not sampled; start from between them, such as 0.99";
}
#endif

#endif
