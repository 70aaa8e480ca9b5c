/* A mixture of phase functions [1/sr]
 *
 *   p(c) = sum over parts of share_k p_k(c),   shares from 0 on, 1 in sum
 *
 * What XML nests, `blendphase` and `dictionary`, in any depth, is flattened to parts that are no mixtures (runtime/scene/model/mixture.h).
 * The shares of all parts but the first are the first numbers n of the model, then come the parts' own. So each number's score
 * is that of the mixture, and has the mean 0; and where a share is 0, the mixture is that of the other parts.
 * A part is picked by its share and drawn from with what is left of the uniform number.
 * Tests: tests/model/phase_mixture_test.cpp */
#ifndef ITN_PHASE_MIXTURE_H
#define ITN_PHASE_MIXTURE_H
#include "model/phase/sized.h"
#include "shared/declaration.h"

/* The share of part k of so many. */
SIZED_MODEL mixture_share(const REAL* n, int parts, int k) {
  if (k > 0) return n[k - 1];
  REAL rest = NUMBER(1);
  UNROLL_FOR(int i = 0; i < parts - 1; ++i) rest = rest - n[i];
  return MAX(rest, NUMBER(0)); /* which rounding may have put below 0 */
}

/* u of those that pick the part, as a uniform number of its own. below: the shares of the parts before */
MODEL mixture_rest_of(REAL u, REAL below, REAL share) {
  REAL own = (u - below) / MAX(share, NUMBER(1e-30));
  return MIN(MAX(own, NUMBER(6e-8)), NUMBER(1 - 6e-8)); /* inside of (0, 1) */
}

#ifndef __OPENCL_VERSION__
/* Mitsuba's `blendphase`: (1 - weight) of the first phase function inside and weight of the second. */
MODEL_VOID blend_phase_shares(const REAL* weight, REAL* shares) {
  shares[0] = NUMBER(1) - weight[0];
  shares[1] = weight[0];
}
/* A path draws from the mixture, so that what a part at 0 would show has no probability there. */
inline const char* blend_phase_obstacle(const double* weight, int) {
  return weight[0] > 0 && weight[0] < 1
             ? ""
             : "at 0 or 1 one of the two is not sampled; start from between them, such as 0.01";
}
#endif

#endif
