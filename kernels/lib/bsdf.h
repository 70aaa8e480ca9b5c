/* The BSDFs by number: the scene's lines of model/bsdf/list.h expanded. `model` and `variant` are constants wherever these are called. */
#ifndef ITN_BSDF_H
#define ITN_BSDF_H
#include "lib/score.h"

#define BSDF_DISPATCH __attribute__((always_inline)) inline

#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: return PREFIX##_TRAITS;
BSDF_DISPATCH int bsdf_traits(int model) {
  switch (model) { BSDFS_OF_SCENE(BSDF_CASE) }
  return 0;
}
#undef BSDF_CASE

#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: return PREFIX##_RANDOM;
BSDF_DISPATCH int bsdf_random(int model) {
  switch (model) { BSDFS_OF_SCENE(BSDF_CASE) }
  return 0;
}
#undef BSDF_CASE

#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: name##_value(variant, n, wi, wo, f); break;
BSDF_DISPATCH void bsdf_value(int model, int variant, const REAL n[], REAL3 wi, REAL3 wo, REAL f[]) {
  switch (model) { BSDFS_OF_SCENE(BSDF_CASE) }
}
#undef BSDF_CASE

#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: return name##_density(variant, n, wi, wo);
BSDF_DISPATCH REAL bsdf_density(int model, int variant, const REAL n[], REAL3 wi, REAL3 wo) {
  switch (model) { BSDFS_OF_SCENE(BSDF_CASE) }
  return (REAL)(0.0f);
}
#undef BSDF_CASE

#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: name##_draw(variant, n, wi, u, wo, weight, pdf, inverse_eta); break;
BSDF_DISPATCH void bsdf_draw(int model, int variant, const REAL n[], REAL3 wi, const REAL u[], REAL3* wo, REAL weight[],
                             REAL* pdf, REAL* inverse_eta) {
  switch (model) { BSDFS_OF_SCENE(BSDF_CASE) }
}
#undef BSDF_CASE

/* What an event adds to the scores of the numbers. first: of the numbers; a BSDF_CASE writes d log f / d n to d. */
#define BSDF_STEP(CASES)                                                     \
  Step step = no_step(first);                                                \
  if (HAS_TEXTURE) step.origins = AS_INT(n[ORIGINS]);                        \
  REAL d[MOST_SLOTS * CHANNELS];                                             \
  UNROLL_FOR(int i = 0; i < MOST_SLOTS * CHANNELS; ++i) d[i] = (REAL)(0.0f); \
  switch (model) { CASES }                                                   \
  add_step(&step, d, mask);                                                  \
  return step;

/* Of the value. */
#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: score_##name(variant, n, wi, wo, d); break;
BSDF_DISPATCH Step bsdf_step(int model, int variant, const REAL n[], INT first, REAL3 wi, REAL3 wo, MASK mask) {
  BSDF_STEP(BSDFS_OF_SCENE(BSDF_CASE))
}
#undef BSDF_CASE

/* Of the share of the light from a chosen direction. */
#define BSDF_CASE(name, PREFIX) \
  case MODEL_##name: score_##name##_chosen(variant, n, wi, wo, d); break;
BSDF_DISPATCH Step bsdf_chosen_step(int model, int variant, const REAL n[], INT first, REAL3 wi, REAL3 wo, MASK mask) {
  BSDF_STEP(BSDFS_OF_SCENE(BSDF_CASE))
}
#undef BSDF_CASE

/* Of the density of what was decided when wo was drawn. reflected: 1 or 0 */
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

/* Of what weighs a sample of bsdf_draw: pdf, as it said, is 0 where wo was chosen. */
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
