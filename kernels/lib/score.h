/* What a path carries to differentiate the image by scene parameters (score function, paper section 4): the score of each
 * ScoreRecord, the sum of d log f / d number over the factors f of its throughput so far. Sampling is held fixed. The
 * derivatives of the factors themselves are printed from kernels/model: derivative/score.h (runtime/derivative). */
#ifndef ITN_SCORE_H
#define ITN_SCORE_H
#include "derivative/score.h"
#include "lib/launch.h"
#include "model/microfacet.h"
#include "model/rough_dielectric.h"

typedef struct {
  REAL of[SCORES + 1]; /* the last one is not used: an array of length 0 is not C */
} Scores;

inline Scores load_scores(const Pool* pool, INT slots) {
  Scores s;
  UNROLL for (int k = 0; k < SCORES; ++k) s.of[k] = LOAD(pool, SCORE + k, slots);
  return s;
}

inline Scores no_scores(void) {
  Scores s;
  UNROLL for (int k = 0; k < SCORES; ++k) s.of[k] = (REAL)(0.0f);
  return s;
}

inline void add_scores(Scores* s, const Scores* step) { UNROLL for (int k = 0; k < SCORES; ++k) s->of[k] += step->of[k]; }

inline void store_scores(const Pool* pool, INT slots, const Scores* s) {
  UNROLL for (int k = 0; k < SCORES; ++k) STORE(pool, SCORE + k, slots, s->of[k]);
}

/* A flight that ends in a scattering at `distance`, with the albedo of the scattering. */
inline void score_scattering(const Launch* launch, __global const JobRecord* job, Scores* s, INT medium,
                             const REAL sigma_t[], const REAL albedo[], REAL distance, MASK mask) {
  UNROLL for (int k = 0; k < SCORES; ++k) {
    __global const ScoreRecord* r = launch->scores + k;
    if (r->kind != SCORE_SIGMA_T && r->kind != SCORE_ALBEDO) continue;
    const int c = THROUGHPUT_CHANNELS == 1 ? 0 : r->channel;
    REAL d_sigma_t, d_albedo;
    score_medium_scattering(sigma_t[c], albedo[c], distance, &d_sigma_t, &d_albedo);
    const REAL d = r->kind == SCORE_SIGMA_T ? d_sigma_t : d_albedo;
    s->of[k] += SELECT(mask & (medium - job->first_medium == r->target), d, 0.0f);
  }
}

/* A flight of `distance` that reaches a surface or a light. */
inline void score_passage(const Launch* launch, __global const JobRecord* job, Scores* s, INT medium,
                          const REAL sigma_t[], REAL distance, MASK mask) {
  UNROLL for (int k = 0; k < SCORES; ++k) {
    __global const ScoreRecord* r = launch->scores + k;
    if (r->kind != SCORE_SIGMA_T) continue;
    REAL d;
    score_medium_passage(sigma_t[THROUGHPUT_CHANNELS == 1 ? 0 : r->channel], distance, &d);
    s->of[k] += SELECT(mask & (medium - job->first_medium == r->target), d, 0.0f);
  }
}

inline void score_phase(const Launch* launch, __global const JobRecord* job, Scores* s, INT medium, REAL cosine, REAL g,
                        MASK mask) {
  UNROLL for (int k = 0; k < SCORES; ++k) {
    __global const ScoreRecord* r = launch->scores + k;
    if (r->kind != SCORE_G) continue;
    REAL d;
    score_henyey_greenstein(cosine, g, &d);
    s->of[k] += SELECT(mask & (medium - job->first_medium == r->target), d, 0.0f);
  }
}

/* eta: inside over outside; distribution: a constant where this is inlined. */
inline void score_rough_boundary(int distribution, const Launch* launch, __global const JobRecord* job, Scores* s,
                                 INT bsdf, REAL alpha, REAL eta, REAL3 wi, REAL3 wo, MASK mask) {
  UNROLL for (int k = 0; k < SCORES; ++k) {
    __global const ScoreRecord* r = launch->scores + k;
    if (r->kind != SCORE_ALPHA && r->kind != SCORE_ETA) continue;
    REAL d_alpha, d_eta;
    if (distribution == MICROFACET_GGX)
      score_rough_dielectric_ggx(alpha, eta, wi, wo, &d_alpha, &d_eta);
    else
      score_rough_dielectric_beckmann(alpha, eta, wi, wo, &d_alpha, &d_eta);
    const REAL d = r->kind == SCORE_ALPHA ? d_alpha : d_eta;
    s->of[k] += SELECT(mask & (bsdf - job->first_bsdf == r->target), d, 0.0f);
  }
}

/* Of the normal m and the lobe that rough_dielectric_sample drew: a density, unlike the factor of the throughput above. By
 * roughness alone: by index its variance is infinite, since at the critical angle the score is. */
inline Scores score_decision_at_boundary(int distribution, const Launch* launch, __global const JobRecord* job, INT bsdf,
                                         REAL alpha, REAL eta, REAL3 wi, REAL3 m, REAL reflected, MASK mask) {
  Scores s = no_scores();
  UNROLL for (int k = 0; k < SCORES; ++k) {
    __global const ScoreRecord* r = launch->scores + k;
    if (r->kind != SCORE_ALPHA) continue;
    REAL d_alpha, ignored;
    if (distribution == MICROFACET_GGX)
      score_rough_dielectric_decision_ggx(alpha, eta, wi, m, reflected, &d_alpha, &ignored);
    else
      score_rough_dielectric_decision_beckmann(alpha, eta, wi, m, reflected, &d_alpha, &ignored);
    s.of[k] = SELECT(mask & (bsdf - job->first_bsdf == r->target), d_alpha, 0.0f);
  }
  return s;
}

inline void score_reflection(const Launch* launch, __global const JobRecord* job, Scores* s, INT bsdf,
                             const REAL reflectance[3], REAL3 wo, MASK mask) {
  UNROLL for (int k = 0; k < SCORES; ++k) {
    __global const ScoreRecord* r = launch->scores + k;
    if (r->kind != SCORE_REFLECTANCE) continue;
    REAL d;
    score_diffuse(reflectance[r->channel], wo, &d);
    s->of[k] += SELECT(mask & (bsdf - job->first_bsdf == r->target), d, 0.0f);
  }
}

/* Adds radiance to the lanes in `mask`, and its derivatives. */
inline void gather_radiance(const Launch* launch, Pool* pool, INT slots, MASK mask,
                            const REAL radiance[RADIANCE_CHANNELS], const Scores* s) {
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c) {
    const REAL x = SELECT(mask, radiance[c], 0.0f);
    STORE(pool, RADIANCE + c, slots, LOAD(pool, RADIANCE + c, slots) + x);
    UNROLL for (int p = 0; p < DERIVATIVES; ++p) {
      __global const DerivativeRecord* r = launch->derivatives + p;
      const int field = DERIVATIVE + p * RADIANCE_CHANNELS + c;
      if (r->factor[c] != 0.0f)
        STORE(pool, field, slots, LOAD(pool, field, slots) + x * r->factor[c] * s->of[r->score[c]]);
    }
  }
}

#endif
