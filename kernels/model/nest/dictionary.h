/* A dictionary (ours): a mixture of any number of BSDFs, with non-negative weights that are divided by their sum, so that
 * they lie on the simplex. The shares are numbers; the host declares as many as there are entries (dictionary_model()). */
#ifndef ITN_NEST_DICTIONARY_H
#define ITN_NEST_DICTIONARY_H
#include "model/nest/nest.h"
#include "model/obstacle.h"

#define DICTIONARY_NUMBERS(NUMBER)
#define DICTIONARY_PARAMETERS(PARAMETER)
#define DICTIONARY_TRAITS 0
enum { DICTIONARY_SLOTS };

MODEL_VOID dictionary_enter(int branch, const REAL* n, REAL3 wi, REAL3 wo, NEST* x) { x->share = x->share * n[branch]; }

#ifndef __OPENCL_VERSION__
MODEL_VOID dictionary_numbers(const REAL*, REAL*) {}
inline const char* dictionary_obstacle(const double*, int) { return differentiable; }

MODEL_VOID dictionary_shares(std::size_t entries, const REAL* weights, REAL* shares) {
  REAL sum = NUMBER(0);
  for (std::size_t k = 0; k < entries; ++k) sum = sum + weights[k];
  for (std::size_t k = 0; k < entries; ++k) shares[k] = weights[k] / sum;
}

inline const char* dictionary_weight_obstacle(double weight) {
  return weight > 0 ? differentiable : "at 0 the entry is not sampled; start from above, such as 0.01";
}
#endif

#endif
