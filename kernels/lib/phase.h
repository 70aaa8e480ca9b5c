/* The phase function of each lane's medium: model/phase/list.h expanded for those that the scene has
 * (PHASES_OF_SCENE of the program, runtime/compile/surfaces.h). Where it has one, no lane chooses. */
#ifndef ITN_PHASE_H
#define ITN_PHASE_H
#include "lib/mixture.h"
#include "lib/numbers.h"

typedef struct {
  INT model, first;   /* n = numbers + first */
  REAL n[MOST_SLOTS]; /* of the lane's model */
} Phase;

#define CHOOSE_PHASE(name, value, other) \
  (PHASE_COUNT == 1 ? (value) : SELECT(phase->model == MODEL_##name, value, other))

inline Phase load_phase(const Launch* launch, INT medium) {
  const INT at = medium * (int)(sizeof(MediumRecord) / sizeof(int));
  __global const int* media = (__global const int*)launch->media;
  const REAL nowhere[2] = {(REAL)(0.0f), (REAL)(0.0f)};
  Phase p;
  p.model = PHASE_COUNT == 1 ? (INT)(0) : GATHER_INT((media + FIELD_OF(MediumRecord, phase)), at);
  p.first = GATHER_INT((media + FIELD_OF(MediumRecord, first_phase_number)), at);
  UNROLL_FOR(int i = 0; i < MOST_SLOTS; ++i) p.n[i] = (REAL)(0.0f);
    /* what a lane of another model reads is not used */
#define LOAD_PHASE(name, PREFIX) load_numbers(launch, MODEL_##name, p.first, nowhere, p.n);
  PHASES_OF_SCENE(LOAD_PHASE)
  return p;
}

inline REAL phase_value(const Phase* phase, REAL cosine) {
  REAL value = (REAL)(0.0f);
#define VALUE_OF_PHASE(name, PREFIX) value = CHOOSE_PHASE(name, name##_value(phase->n, cosine), value);
  PHASES_OF_SCENE(VALUE_OF_PHASE)
  return value;
}

inline void phase_draw(const Phase* phase, REAL u, REAL* cosine, REAL* sine) {
  *cosine = *sine = (REAL)(0.0f);
#define DRAW_FROM_PHASE(name, PREFIX)                  \
  {                                                    \
    REAL own_cosine, own_sine;                         \
    name##_draw(phase->n, u, &own_cosine, &own_sine);  \
    *cosine = CHOOSE_PHASE(name, own_cosine, *cosine); \
    *sine = CHOOSE_PHASE(name, own_sine, *sine);       \
  }
  PHASES_OF_SCENE(DRAW_FROM_PHASE)
}

#endif
