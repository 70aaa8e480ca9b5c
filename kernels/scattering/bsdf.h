/* The BSDFs by number: the scene's lines of model/bsdf/list.h expanded. `model` and `variant` are constants wherever these are called. */
#ifndef ITN_BSDF_H
#define ITN_BSDF_H
#include "scattering/bump.h"
#include "texture/measured.h"
#include "derivative/score.h"
#include "scattering/structure.h"

#define BSDF_DISPATCH __attribute__((always_inline)) INLINE

#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: return PREFIX##_TRAITS;
BSDF_DISPATCH int bsdf_traits(int model) {
  switch (model) { BSDFS_OF_SCENE(BSDF_CASE) STRUCTURES_OF_SCENE(BSDF_CASE) }
  return 0;
}
#undef BSDF_CASE

#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: return PREFIX##_RANDOM;
BSDF_DISPATCH int bsdf_random(int model) {
  switch (model) { BSDFS_OF_SCENE(BSDF_CASE) STRUCTURES_OF_SCENE(BSDF_CASE) }
  return 0;
}
#undef BSDF_CASE

#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: name##_value(variant, n, wi, wo, f); break;
BSDF_DISPATCH void bsdf_value(int model, int variant, const REAL n[], REAL3 wi, REAL3 wo, REAL f[]) {
  switch (model) { BSDFS_OF_SCENE(BSDF_CASE) STRUCTURES_OF_SCENE(BSDF_CASE) }
}
#undef BSDF_CASE

#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: return name##_density(variant, n, wi, wo);
BSDF_DISPATCH REAL bsdf_density(int model, int variant, const REAL n[], REAL3 wi, REAL3 wo) {
  switch (model) { BSDFS_OF_SCENE(BSDF_CASE) STRUCTURES_OF_SCENE(BSDF_CASE) }
  return (REAL)(0.0f);
}
#undef BSDF_CASE

#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: name##_draw(variant, n, wi, u, wo, weight, pdf, inverse_eta); break;
BSDF_DISPATCH void bsdf_draw(int model, int variant, const REAL n[], REAL3 wi, const REAL u[], REAL3* wo, REAL weight[],
                             REAL* pdf, REAL* inverse_eta) {
  switch (model) { BSDFS_OF_SCENE(BSDF_CASE) STRUCTURES_OF_SCENE(BSDF_CASE) }
}
#undef BSDF_CASE

/* Looks up what tables say of the two directions, to n, from where the functions above and below know. */
#define MEASURE_LEAF(structure, at, first)                                   \
  {                                                                          \
    const Nest x = structure##_at_##at(n, wi, wo);                           \
    merl_measure(launch, n + first, nest_local(&x, wi), nest_local(&x, wo)); \
  }
#define STRUCTURE_CASE(name, PREFIX) \
  case MODEL_##name: PREFIX##_MEASURED(MEASURE_LEAF) break;
BSDF_DISPATCH void bsdf_measure(int model, const Launch* launch, REAL n[], REAL3 wi, REAL3 wo) {
  if (!(bsdf_traits(model) & BSDF_MEASURED)) return;
  if (bsdf_traits(model) & BSDF_STRUCTURE) switch (model) {
      STRUCTURES_OF_SCENE(STRUCTURE_CASE)
    }
  else
    merl_measure(launch, n, wi, wo);
}
#undef STRUCTURE_CASE

/* bsdf_draw, where the value in the direction drawn is looked up. */
BSDF_DISPATCH void bsdf_sample(int model, int variant, const Launch* launch, REAL n[], REAL3 wi, const REAL u[],
                               REAL3* wo, REAL weight[], REAL* pdf, REAL* inverse_eta) {
  bsdf_draw(model, variant, n, wi, u, wo, weight, pdf, inverse_eta);
  if (!(bsdf_traits(model) & BSDF_MEASURED)) return;
  bsdf_measure(model, launch, n, wi, *wo);
  REAL f[CHANNELS];
  bsdf_value(model, variant, n, wi, *wo, f);
  const REAL scale = 1.0f / (MAX(*pdf, (REAL)(1e-20f)) * *inverse_eta * *inverse_eta);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) weight[c] = SELECT(*pdf > 0.0f, f[c] * scale, weight[c]);
}

/* Structures: which leaf a sample is of, by u; to n, from where the functions above and below know. */
#define STRUCTURE_CASE(name, PREFIX) \
  case MODEL_##name: n[PREFIX##_picked] = name##_pick(n, wi, u); break;
BSDF_DISPATCH void bsdf_pick(int model, REAL n[], REAL3 wi, REAL u) {
  switch (model) { STRUCTURES_OF_SCENE(STRUCTURE_CASE) }
}
#undef STRUCTURE_CASE

/* Does the picked leaf let light pass straight on? */
#define STRUCTURE_CASE(name, PREFIX) \
  case MODEL_##name: return n[PREFIX##_picked] == (float)PASSAGE_LEAF;
BSDF_DISPATCH MASK bsdf_passes(int model, const REAL n[]) {
  if (bsdf_traits(model) & BSDF_PASSES) switch (model) {
      STRUCTURES_OF_SCENE(STRUCTURE_CASE)
    }
  return (MASK)(0);
}
#undef STRUCTURE_CASE

/* Does the path go on as through a thin pane, which counts no more than an index-matched boundary? */
#define STRUCTURE_CASE(name, PREFIX) \
  case MODEL_##name: return opposite & name##_is_thin(n);
BSDF_DISPATCH MASK bsdf_straight(int model, const REAL n[], REAL3 wi, REAL3 wo) {
  if (!(bsdf_traits(model) & BSDF_THIN)) return (MASK)(0);
  const MASK opposite = wi.z * wo.z < 0.0f;
  switch (model) { STRUCTURES_OF_SCENE(STRUCTURE_CASE) }
  return (bsdf_traits(model) & BSDF_SMOOTH) ? opposite : (MASK)(0);
}
#undef STRUCTURE_CASE

/* Bump maps: from the slopes of their textures to normals in the frame (model/nest/bump_map.h). */
#define BEND_BY_SLOPES(first) bend_by_slopes(n + first, &axes, normal, frame);
#define STRUCTURE_CASE(name, PREFIX) \
  case MODEL_##name: PREFIX##_BUMPS(BEND_BY_SLOPES) break;
BSDF_DISPATCH void bsdf_bump(int model, const Launch* launch, INT primitive, REAL3 position, REAL3 normal,
                             const Frame* frame, REAL n[]) {
  if (!(bsdf_traits(model) & BSDF_BUMPED)) return;
  const TextureAxes axes = texture_axes(launch->primitives, launch->texture_axes, primitive, position, normal);
  switch (model) { STRUCTURES_OF_SCENE(STRUCTURE_CASE) }
}
#undef STRUCTURE_CASE

/* The share of the light that passes straight on, unless it is 0; n says then that the leaf is a passage. */
#define STRUCTURE_CASE(name, PREFIX) \
  case MODEL_##name: n[PREFIX##_picked] = (REAL)((float)PASSAGE_LEAF); return name##_passage(n, wi);
BSDF_DISPATCH REAL bsdf_passage(int model, REAL n[], REAL3 wi) {
  switch (model) { STRUCTURES_OF_SCENE(STRUCTURE_CASE) }
  return (REAL)(0.0f);
}
#undef STRUCTURE_CASE

/* d log f / d the normals of bump maps, in d, to those by the slopes that made them. */
#define STEP_BY_SLOPES(first)                                                                     \
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) {                                                      \
    REAL by_u = (REAL)(0.0f), by_v = (REAL)(0.0f);                                                \
    UNROLL_FOR(int k = 0; k < 3; ++k) {                                                           \
      by_u += d[(first + BUMP_MAP_texture + k) * CHANNELS + c] * n[first + BUMP_MAP_along_u + k]; \
      by_v += d[(first + BUMP_MAP_texture + k) * CHANNELS + c] * n[first + BUMP_MAP_along_v + k]; \
      d[(first + BUMP_MAP_texture + k) * CHANNELS + c] = (REAL)(0.0f);                            \
    }                                                                                             \
    d[(first + BUMP_MAP_texture) * CHANNELS + c] = by_u;                                          \
    d[(first + BUMP_MAP_texture + 1) * CHANNELS + c] = by_v;                                      \
  }
#define STRUCTURE_CASE(name, PREFIX) \
  case MODEL_##name: PREFIX##_BUMPS(STEP_BY_SLOPES) break;
BSDF_DISPATCH void step_by_slopes(int model, const REAL n[], REAL d[]) {
#if TEXEL_SUMS
  switch (model) { STRUCTURES_OF_SCENE(STRUCTURE_CASE) }
#endif
}
#undef STRUCTURE_CASE

/* The step that an event adds to the scores of the numbers. first: of the numbers; a BSDF_CASE writes d log f / d n
 * to d. */
#define BSDF_STEP(CASES)                                                                                               \
  Step step = no_step(first);                                                                                          \
  UNROLL_FOR(int word = 0; HAS_TEXTURE && word < ORIGIN_WORDS; ++word) step.origins[word] = AS_INT(n[ORIGINS + word]); \
  REAL d[MOST_SLOTS * CHANNELS];                                                                                       \
  UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) d[i] = (REAL)(0.0f);                                           \
  switch (model) { CASES }                                                                                             \
  step_by_slopes(model, n, d);                                                                                         \
  add_step(&step, d, mask);                                                                                            \
  return step;

/* The step of the value. */
#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: score_##name(variant, n, wi, wo, d); break;
BSDF_DISPATCH Step bsdf_step(int model, int variant, const REAL n[], INT first, REAL3 wi, REAL3 wo, MASK mask) {
  BSDF_STEP(BSDFS_OF_SCENE(BSDF_CASE) STRUCTURES_OF_SCENE(BSDF_CASE))
}
#undef BSDF_CASE

/* The step of the share of the light from a chosen direction. */
#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: score_##name##_chosen(variant, n, wi, wo, d); break;
BSDF_DISPATCH Step bsdf_chosen_step(int model, int variant, const REAL n[], INT first, REAL3 wi, REAL3 wo, MASK mask) {
  BSDF_STEP(BSDFS_OF_SCENE(BSDF_CASE) STRUCTURES_OF_SCENE(BSDF_CASE))
}
#undef BSDF_CASE

/* The step of the density of what was decided when wo was drawn. reflected: 1 or 0 */
#define BSDF_CASE(name, PREFIX)                                                                           \
  case MODEL_##name:                                                                                      \
    score_##name##_decision(variant, n, wi, name##_outcome(variant, n, wi, wo, reflected), reflected, d); \
    break;
BSDF_DISPATCH Step bsdf_decision_step(int model, int variant, const REAL n[], INT first, REAL3 wi, REAL3 wo,
                                      REAL reflected, MASK mask) {
  BSDF_STEP(BSDFS_OF_SCENE(BSDF_CASE))
}
#undef BSDF_CASE
#undef BSDF_STEP

/* The step of the weight of a sample of bsdf_draw: its pdf is 0 where wo was chosen. */
BSDF_DISPATCH Step bsdf_sample_step(int model, int variant, const REAL n[], INT first, REAL3 wi, REAL3 wo, REAL pdf,
                                    MASK mask) {
  const int traits = bsdf_traits(model);
  if (traits & BSDF_SMOOTH) return bsdf_chosen_step(model, variant, n, first, wi, wo, mask);
  if (!(traits & BSDF_PARTLY_SMOOTH)) return bsdf_step(model, variant, n, first, wi, wo, mask);
  const MASK chosen = pdf == 0.0f;
  Step step = bsdf_step(model, variant, n, first, wi, wo, mask & !chosen);
  const Step other = bsdf_chosen_step(model, variant, n, first, wi, wo, mask & chosen);
  UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) step.of[i] += other.of[i];
  return step;
}

#endif
