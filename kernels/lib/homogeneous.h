/* The homogeneous medium that each lane is in. */
#ifndef ITN_HOMOGENEOUS_LANES_H
#define ITN_HOMOGENEOUS_LANES_H
#include "lib/score.h"

typedef struct {
  INT first; /* n = numbers + first */
  REAL n[MOST_SLOTS];
} Homogeneous;

inline Homogeneous load_homogeneous(const Launch* launch, INT medium) {
  const REAL nowhere[2] = {(REAL)(0.0f), (REAL)(0.0f)};
  Homogeneous m;
  m.first = GATHER_INT(((__global const int*)launch->media + FIELD_OF(MediumRecord, first_number)),
                       medium * (int)(sizeof(MediumRecord) / sizeof(int)));
  UNROLL_FOR(int i = 0; i < MOST_SLOTS; ++i) m.n[i] = (REAL)(0.0f);
  load_numbers(launch, MODEL_homogeneous, m.first, nowhere, m.n);
  return m;
}

/* Flights of `distance` that reach a surface or a light, and such that end in a scattering. */
inline void step_passage(Step* s, const REAL n[], REAL distance, MASK mask) {
  REAL d[MOST_SLOTS * CHANNELS];
  UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) d[i] = (REAL)(0.0f);
  score_homogeneous_passage(n, distance, d);
  add_step(s, d, mask);
}
inline void step_scattering(Step* s, const REAL n[], REAL distance, MASK mask) {
  REAL d[MOST_SLOTS * CHANNELS];
  UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) d[i] = (REAL)(0.0f);
  score_homogeneous_scattering(n, distance, d);
  add_step(s, d, mask);
}

#endif
