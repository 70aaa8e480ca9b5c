/* The phase function of each lane's medium: model/phase/list.h expanded for those that the scene has
 * (PHASES_OF_SCENE of the program, runtime/render/compile/surfaces.h). Where it has one, no lane chooses.
 * A field (texture/field.h) may stand for a number of it: place_phase() looks these numbers up. PHASE_FIELDS: how many
 * there are at most in a medium. */
#ifndef ITN_PHASE_H
#define ITN_PHASE_H
#include "texture/field.h"
#include "scattering/mixture.h"
#include "texture/numbers.h"

typedef struct {
  INT model, first;   /* n = numbers + first */
  REAL n[MOST_SLOTS]; /* of the lane's model */
#if PHASE_FIELDS
  INT first_field, fields; /* of the launch, and how many */
  REAL3 place;             /* where they were looked up */
#endif
} Phase;

#define CHOOSE_PHASE(name, value, other) \
  (PHASE_COUNT == 1 ? (value) : SELECT(phase->model == MODEL_##name, value, other))

INLINE Phase load_phase(const Launch* launch, INT medium) {
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
#if PHASE_FIELDS
  p.first_field = GATHER_INT((media + FIELD_OF(MediumRecord, first_phase_field)), at);
  p.fields = GATHER_INT((media + FIELD_OF(MediumRecord, phase_fields)), at);
  p.place = make3((REAL)(0.0f), (REAL)(0.0f), (REAL)(0.0f));
#endif
  return p;
}

/* The numbers at a place, of the lanes in `mask`. */
INLINE void place_phase(const Launch* launch, Phase* phase, REAL3 place, MASK mask) {
#if PHASE_FIELDS
  phase->place = place;
  for (int k = 0; k < PHASE_FIELDS; ++k) {
    uint left = lane_bits(mask & (phase->fields > k));
    while (left) {
      __global const FieldRecord* field;
      const MASK here = next_field(launch, phase->first_field + k, &left, &field);
      REAL value[1];
      field_value(launch, field, place, 1, value);
      UNROLL_FOR(int slot = 0; slot < MOST_SLOTS; ++slot)
        if (slot == field->slot) phase->n[slot] = SELECT(here, value[0], phase->n[slot]);
    }
  }
#endif
}

INLINE REAL phase_value(const Phase* phase, REAL cosine) {
  REAL value = (REAL)(0.0f);
#define VALUE_OF_PHASE(name, PREFIX) value = CHOOSE_PHASE(name, name##_value(phase->n, cosine), value);
  PHASES_OF_SCENE(VALUE_OF_PHASE)
  return value;
}

INLINE void phase_draw(const Phase* phase, REAL u, REAL* cosine, REAL* sine) {
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
