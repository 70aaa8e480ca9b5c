/* Common code of BSDFs: those that decide on a direction and nothing else, those that draw all directions, those that
 * choose all of them (list.h). */
#ifndef ITN_BSDF_REFLECTION_H
#define ITN_BSDF_REFLECTION_H
#include "shared/declaration.h"

/* The decision is the direction, and log f has no edge. */
#define BSDF_DECIDES_DIRECTION(name)                                                                   \
  MODEL3 name##_outcome(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL reflected) { return wo; } \
  MODEL name##_decision(int variant, const REAL* n, REAL3 wi, REAL3 outcome, REAL reflected) {         \
    return name##_density(variant, n, wi, outcome);                                                    \
  }                                                                                                    \
  MODEL name##_edge(int variant, const REAL* n, REAL3 wi, REAL3 wo) { return NUMBER(0); }

/* No direction is chosen. */
#define BSDF_DRAWS_ALL(name)                                                          \
  MODEL_VOID name##_chosen(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) { \
    UNROLL_FOR(int c = 0; c < CHANNELS; ++c) f[c] = NUMBER(0);                        \
  }

/* No direction is drawn. */
#define BSDF_CHOOSES_ALL(name)                                                       \
  MODEL_VOID name##_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) { \
    UNROLL_FOR(int c = 0; c < CHANNELS; ++c) f[c] = NUMBER(0);                       \
  }                                                                                  \
  MODEL name##_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) { return NUMBER(0); }

#endif
