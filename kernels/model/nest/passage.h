/* Light that passes straight on, as through an index-matched boundary: the leaf of masks and of `null` inside of a blend. It
 * has the functions of a BSDF (model/bsdf/list.h). */
#ifndef ITN_NEST_PASSAGE_H
#define ITN_NEST_PASSAGE_H
#include "model/bsdf/reflection.h"

#define PASSAGE_TRAITS (BSDF_TRANSMITS | BSDF_SMOOTH | BSDF_THIN)
#define PASSAGE_RANDOM 0
/* The index of all of a structure's leaves that are passages. */
#define PASSAGE_LEAF (-1)

MODEL_VOID passage_chosen(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) f[c] = NUMBER(1);
}

MODEL_VOID passage_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                        REAL* inverse_eta) {
  *wo = scale3(wi, NUMBER(-1));
  *pdf = NUMBER(0);
  *inverse_eta = NUMBER(1);
  passage_chosen(variant, n, wi, *wo, weight);
}

BSDF_CHOOSES_ALL(passage)

#endif
