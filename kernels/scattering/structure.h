/* Structures: what the scene's XML nests, as BSDFs of the program's own. Its text (program/structures.h) says of each
 *
 *   PREFIX_NUMBERS, PREFIX_TRAITS, PREFIX_RANDOM, as a BSDF's file does (model/bsdf/list.h); the last number is `picked`:
 *                         the leaf of a sample
 *   PREFIX_LEAVES(LEAF)   LEAF(structure, at, leaf, model, variant, first, thin): leaf: its index, or PASSAGE_LEAF; its numbers are
 *                         n + first
 *   structure_at_<first>  a function for each leaf: the nests around it (model/nest/nest.h)
 *
 * from which STRUCTURE_FUNCTIONS makes the functions that stages call. */
#ifndef ITN_STRUCTURE_H
#define ITN_STRUCTURE_H
#include "shared/vector.h"
#include "model/models.h"
#include "model/nest/list.h"
#include "program/structures.h"
#include "program/surfaces.h"

#define VALUE_OF_LEAF(structure, at, leaf, model, variant, first, thin)                                   \
  {                                                                                                       \
    const Nest x = structure##_at_##at(n, wi, wo);                                                        \
    REAL g[CHANNELS];                                                                                     \
    model##_value(variant, n + first, nest_local(&x, wi), nest_local(&x, wo), g);                         \
    UNROLL_FOR(int c = 0; c < CHANNELS; ++c) f[c] += SELECT(x.seen > 0.0f, x.share * x.lit * g[c], 0.0f); \
  }

#define DENSITY_OF_LEAF(structure, at, leaf, model, variant, first, thin)                         \
  {                                                                                               \
    const Nest x = structure##_at_##at(n, wi, wo);                                                \
    const REAL own = model##_density(variant, n + first, nest_local(&x, wi), nest_local(&x, wo)); \
    density += SELECT(x.seen > 0.0f, x.share * own, 0.0f);                                        \
  }

#define PICK_LEAF(structure, at, leaf, model, variant, first, thin)        \
  {                                                                        \
    const Nest x = structure##_at_##at(n, wi, wi);                         \
    picked = SELECT((u >= sum) & (x.share > 0.0f), (float)(leaf), picked); \
    sum += x.share;                                                        \
  }

#define PASSAGE_OF_LEAF(structure, at, leaf, model, variant, first, thin) \
  if (leaf == PASSAGE_LEAF) {                                             \
    const Nest x = structure##_at_##at(n, wi, wi);                        \
    share += x.share;                                                     \
  }

#define THIN_LEAF(structure, at, leaf, model, variant, first, thin) \
  if (thin) is_thin = is_thin | (picked == (float)(leaf));

/* wo of the lanes that have picked the leaf. A direction that leaves on a side where the leaf is not seen is lost. */
#define DRAW_LEAF(structure, at, leaf, model, variant, first, thin)                \
  {                                                                                \
    const MASK here = picked == (float)(leaf);                                     \
    if (ANY(here)) {                                                               \
      const Nest x = structure##_at_##at(n, wi, wi);                               \
      REAL3 own;                                                                   \
      REAL w[CHANNELS], p, e;                                                      \
      model##_draw(variant, n + first, nest_local(&x, wi), u, &own, w, &p, &e);    \
      own = nest_world(&x, own);                                                   \
      const Nest there = structure##_at_##at(n, wi, own);                          \
      const MASK lost = !(there.seen > 0.0f);                                      \
      *wo = select3(here, own, *wo);                                               \
      *pdf = SELECT(here, SELECT(lost, 0.0f, p), *pdf);                            \
      *inverse_eta = SELECT(here, e, *inverse_eta);                                \
      UNROLL_FOR(int c = 0; c < CHANNELS; ++c)                                     \
        weight[c] = SELECT(here, SELECT(lost, 0.0f, w[c] * there.lit), weight[c]); \
    }                                                                              \
  }

#define COUNT_LEAF(structure, at, leaf, model, variant, first, thin) +1

#define STRUCTURE_FUNCTIONS(structure, PREFIX)                                                                \
  INLINE void structure##_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {                    \
    UNROLL_FOR(int c = 0; c < CHANNELS; ++c) f[c] = (REAL)(0.0f);                                             \
    PREFIX##_LEAVES(VALUE_OF_LEAF)                                                                            \
  }                                                                                                           \
  INLINE REAL structure##_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {                           \
    REAL density = (REAL)(0.0f);                                                                              \
    PREFIX##_LEAVES(DENSITY_OF_LEAF) return density;                                                          \
  }                                                                                                           \
  INLINE REAL structure##_pick(const REAL* n, REAL3 wi, REAL u) {                                             \
    REAL picked = (REAL)(0.0f), sum = (REAL)(0.0f);                                                           \
    PREFIX##_LEAVES(PICK_LEAF) return picked;                                                                 \
  }                                                                                                           \
  INLINE REAL structure##_passage(const REAL* n, REAL3 wi) {                                                  \
    REAL share = (REAL)(0.0f);                                                                                \
    PREFIX##_LEAVES(PASSAGE_OF_LEAF) return share;                                                            \
  }                                                                                                           \
  INLINE MASK structure##_is_thin(const REAL* n) {                                                            \
    const REAL picked = n[PREFIX##_picked];                                                                   \
    MASK is_thin = (MASK)(0);                                                                                 \
    PREFIX##_LEAVES(THIN_LEAF) return is_thin;                                                                \
  }                                                                                                           \
  /* By the leaf in n[PREFIX_picked]. Weighed by the sum over all leaves, unless the direction was chosen. */ \
  INLINE void structure##_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight,  \
                               REAL* pdf, REAL* inverse_eta) {                                                \
    const REAL picked = n[PREFIX##_picked];                                                                   \
    *wo = wi;                                                                                                 \
    *pdf = (REAL)(0.0f);                                                                                      \
    *inverse_eta = (REAL)(1.0f);                                                                              \
    UNROLL_FOR(int c = 0; c < CHANNELS; ++c) weight[c] = (REAL)(0.0f);                                        \
    PREFIX##_LEAVES(DRAW_LEAF) if ((0 PREFIX##_LEAVES(COUNT_LEAF)) == 1) return;                              \
    const MASK drawn = *pdf > 0.0f;                                                                           \
    REAL f[CHANNELS];                                                                                         \
    structure##_value(variant, n, wi, *wo, f);                                                                \
    const REAL density = structure##_density(variant, n, wi, *wo);                                            \
    const REAL scale = 1.0f / (MAX(density, (REAL)(1e-20f)) * *inverse_eta * *inverse_eta);                   \
    *pdf = SELECT(drawn, density, 0.0f);                                                                      \
    UNROLL_FOR(int c = 0; c < CHANNELS; ++c)                                                                  \
      weight[c] = SELECT(drawn, SELECT(density > 0.0f, f[c] * scale, 0.0f), weight[c]);                       \
  }

STRUCTURES_OF_SCENE(STRUCTURE_FUNCTIONS)

#endif
