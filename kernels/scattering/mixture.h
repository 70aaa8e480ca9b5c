/* Tables and mixtures of phase functions, which programs have of their own: their text (program/structures.h) declares each as a
 * phase function's file does (model/phase/list.h), and says
 *
 *   PREFIX_VALUES        of a table: how many
 *   PREFIX_PARTS         of a mixture: how many
 *   PREFIX_EACH(PART)    PART(k, model, first): the model of part k, whose numbers are n + first
 *
 * from which functions of that name are made here. */
#ifndef ITN_MIXTURE_H
#define ITN_MIXTURE_H
#include "model/phase/list.h"
#include "model/phase/tabulated.h"
#include "program/structures.h"
#include "program/surfaces.h"

#define TABLE_FUNCTIONS(name, PREFIX)                                                                          \
  INLINE REAL name##_value(const REAL* n, REAL cosine) { return tabulated_value(PREFIX##_VALUES, n, cosine); } \
  INLINE void name##_draw(const REAL* n, REAL u, REAL* cosine, REAL* sine) {                                   \
    tabulated_draw(PREFIX##_VALUES, n, u, cosine, sine);                                                       \
  }

#define VALUE_OF_PART(k, model, first) value += mixture_share(n, parts, k) * model##_value(n + first, cosine);

#define DRAW_PART(k, model, first)                                                     \
  {                                                                                    \
    const REAL share = mixture_share(n, parts, k);                                     \
    const MASK picked = (u >= below) & (share > 0.0f);                                 \
    REAL own_cosine, own_sine;                                                         \
    model##_draw(n + first, mixture_rest_of(u, below, share), &own_cosine, &own_sine); \
    *cosine = SELECT(picked, own_cosine, *cosine);                                     \
    *sine = SELECT(picked, own_sine, *sine);                                           \
    below += share;                                                                    \
  }

#define MIXTURE_FUNCTIONS(name, PREFIX)                                      \
  INLINE REAL name##_value(const REAL* n, REAL cosine) {                     \
    const int parts = PREFIX##_PARTS;                                        \
    REAL value = (REAL)(0.0f);                                               \
    PREFIX##_EACH(VALUE_OF_PART) return value;                               \
  }                                                                          \
  INLINE void name##_draw(const REAL* n, REAL u, REAL* cosine, REAL* sine) { \
    const int parts = PREFIX##_PARTS;                                        \
    REAL below = (REAL)(0.0f);                                               \
    *cosine = (REAL)(1.0f);                                                  \
    *sine = (REAL)(0.0f);                                                    \
    PREFIX##_EACH(DRAW_PART)                                                 \
  }

TABLES_OF_SCENE(TABLE_FUNCTIONS)
MIXTURES_OF_SCENE(MIXTURE_FUNCTIONS)

#endif
