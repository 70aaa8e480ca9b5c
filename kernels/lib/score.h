/* What a path carries to differentiate the image by scene parameters (score function, paper section 4): the score of each
 * ScoreRecord, the sum of d log f / d number over the factors f of its throughput so far. Sampling is held fixed. The
 * derivatives of the factors themselves are printed from kernels/model: derivative/score.h (runtime/derivative). */
#ifndef ITN_SCORE_H
#define ITN_SCORE_H
#include "derivative/score.h"
#include "lib/adjoint.h"
#include "lib/launch.h"
#include "model/microfacet.h"
#include "model/rough_dielectric.h"

/* d log f of the factors that one event adds, by the numbers of the medium and of the BSDF that it concerns; 0: no part. */
typedef struct {
  INT medium; /* in the launch's array */
  REAL sigma_t[THROUGHPUT_CHANNELS], albedo[THROUGHPUT_CHANNELS], g;
} MediumStep;

typedef struct {
  INT bsdf; /* in the launch's array */
  REAL alpha, eta, reflectance[3];
} SurfaceStep;

inline MediumStep no_medium_step(INT medium) {
  MediumStep s;
  s.medium = medium;
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) s.sigma_t[c] = s.albedo[c] = (REAL)(0.0f);
  s.g = (REAL)(0.0f);
  return s;
}

inline SurfaceStep no_surface_step(void) {
  SurfaceStep s;
  s.bsdf = (INT)(0);
  s.alpha = s.eta = s.reflectance[0] = s.reflectance[1] = s.reflectance[2] = (REAL)(0.0f);
  return s;
}

/* Gradients are by logarithms; there is none by a number that is 0. */
inline REAL by_number(REAL d, REAL number) {
#if ADJOINT
  return SELECT(number > 0.0f, d * number, 0.0f);
#else
  return d;
#endif
}

/* A flight that ends in a scattering at `distance`, with the albedo of the scattering. */
inline void step_scattering(MediumStep* s, const REAL sigma_t[], const REAL albedo[], REAL distance, MASK mask) {
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) {
    REAL d_sigma_t, d_albedo;
    score_medium_scattering(sigma_t[c], albedo[c], distance, &d_sigma_t, &d_albedo);
    s->sigma_t[c] += SELECT(mask, by_number(d_sigma_t, sigma_t[c]), 0.0f);
    s->albedo[c] += SELECT(mask, by_number(d_albedo, albedo[c]), 0.0f);
  }
}

/* A flight of `distance` that reaches a surface or a light. */
inline void step_passage(MediumStep* s, const REAL sigma_t[], REAL distance, MASK mask) {
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) {
    REAL d;
    score_medium_passage(sigma_t[c], distance, &d);
    s->sigma_t[c] += SELECT(mask, by_number(d, sigma_t[c]), 0.0f);
  }
}

inline void step_phase(MediumStep* s, REAL cosine, REAL g, MASK mask) {
  REAL d;
  score_henyey_greenstein(cosine, g, &d);
  s->g += SELECT(mask, by_number(d, 1.0f - g * g), 0.0f);
}

/* eta: inside over outside; distribution: a constant where this is inlined. */
inline void step_rough_boundary(int distribution, SurfaceStep* s, INT bsdf, REAL alpha, REAL eta, REAL3 wi, REAL3 wo,
                                MASK mask) {
  REAL d_alpha, d_eta;
  if (distribution == MICROFACET_GGX)
    score_rough_dielectric_ggx(alpha, eta, wi, wo, &d_alpha, &d_eta);
  else
    score_rough_dielectric_beckmann(alpha, eta, wi, wo, &d_alpha, &d_eta);
  s->bsdf = bsdf;
  s->alpha += SELECT(mask, by_number(d_alpha, alpha), 0.0f);
  s->eta += SELECT(mask, by_number(d_eta, eta), 0.0f);
}

inline void step_reflection(SurfaceStep* s, INT bsdf, const REAL reflectance[3], REAL3 wo, MASK mask) {
  s->bsdf = bsdf;
  UNROLL for (int c = 0; c < 3; ++c) {
    REAL d;
    score_diffuse(reflectance[c], wo, &d);
    s->reflectance[c] += SELECT(mask, by_number(d, reflectance[c]), 0.0f);
  }
}

/* Known when the program is built: scores that are not asked for cost nothing. */
__constant ScoreRecord carried[SCORES + 1] = {SCORE_RECORDS};

typedef struct {
  REAL of[SCORES + 1]; /* the last one is not used: an array of length 0 is not C */
#if ADJOINT
  Pulled pulled;
#endif
} Scores;

inline Scores no_scores(void) {
  Scores s;
  UNROLL for (int k = 0; k < SCORES; ++k) s.of[k] = (REAL)(0.0f);
  return s;
}

inline Scores load_scores(__global const JobRecord* job, const Pool* pool, INT slots) {
  Scores s;
  UNROLL for (int k = 0; k < SCORES; ++k) s.of[k] = LOAD(pool, SCORE + k, slots);
#if ADJOINT
  REAL baseline[BASELINE_TOTALS + 1];
  UNROLL for (int c = 0; c < BASELINE_TOTALS; ++c) baseline[c] = LOAD(pool, BASELINE + c, slots);
  s.pulled = nothing_pulled();
  pull_by_rest(&s.pulled, job, pool, slots, baseline);
#endif
  return s;
}

/* Of what the lanes in `mask` have added since load_scores. */
inline void store_scores(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                         const Scores* s, MASK mask) {
  UNROLL for (int k = 0; k < SCORES; ++k) STORE(pool, SCORE + k, slots, s->of[k]);
#if ADJOINT
  if (job->replay) add_pulled(launch, job, pool, slots, mask, &s->pulled);
#endif
}

inline void add_flight_step(__global const JobRecord* job, Scores* s, const MediumStep* step) {
  UNROLL for (int k = 0; k < SCORES; ++k) {
    const ScoreRecord r = carried[k];
    if (r.kind != SCORE_SIGMA_T && r.kind != SCORE_ALBEDO) continue;
    const int c = THROUGHPUT_CHANNELS == 1 ? 0 : r.channel;
    const REAL d = r.kind == SCORE_SIGMA_T ? step->sigma_t[c] : step->albedo[c];
    s->of[k] += SELECT(step->medium - job->first_medium == r.target, d, 0.0f);
  }
#if ADJOINT
  if (!job->replay) return;
  s->pulled.first = step->medium * (MEDIUM_NUMBERS * RADIANCE_CHANNELS);
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c) {
    const REAL weight = s->pulled.weight[c];
    pull(&s->pulled, MEDIUM_SIGMA_T, c, step->sigma_t[THROUGHPUT_CHANNELS == 1 ? 0 : c], weight - s->pulled.expected[c]);
    pull(&s->pulled, MEDIUM_ALBEDO, c, step->albedo[THROUGHPUT_CHANNELS == 1 ? 0 : c], weight);
  }
#endif
}

inline void add_phase_step(__global const JobRecord* job, Scores* s, const MediumStep* step) {
  UNROLL for (int k = 0; k < SCORES; ++k) {
    const ScoreRecord r = carried[k];
    if (r.kind == SCORE_G) s->of[k] += SELECT(step->medium - job->first_medium == r.target, step->g, 0.0f);
  }
#if ADJOINT
  if (!job->replay) return;
  s->pulled.first = step->medium * (MEDIUM_NUMBERS * RADIANCE_CHANNELS);
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c)
    pull(&s->pulled, MEDIUM_G, c, step->g, s->pulled.weight[c] - s->pulled.expected[c]);
#endif
}

inline void add_surface_step(__global const JobRecord* job, Scores* s, const SurfaceStep* step) {
  UNROLL for (int k = 0; k < SCORES; ++k) {
    const ScoreRecord r = carried[k];
    if (r.kind != SCORE_ALPHA && r.kind != SCORE_ETA && r.kind != SCORE_REFLECTANCE) continue;
    const REAL d = r.kind == SCORE_ALPHA ? step->alpha : r.kind == SCORE_ETA ? step->eta : step->reflectance[r.channel];
    s->of[k] += SELECT(step->bsdf - job->first_bsdf == r.target, d, 0.0f);
  }
#if ADJOINT
  if (!job->replay) return;
  s->pulled.first = (step->bsdf * BSDF_NUMBERS + MEDIA * MEDIUM_NUMBERS) * RADIANCE_CHANNELS;
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c) {
    const REAL weight = s->pulled.weight[c];
    pull(&s->pulled, BSDF_ALPHA, c, step->alpha, weight);
    pull(&s->pulled, BSDF_ETA, c, step->eta, weight);
    pull(&s->pulled, BSDF_REFLECTANCE, c, step->reflectance[c], weight);
  }
#endif
}

/* Of the normal m and the lobe that rough_dielectric_sample drew: a density, unlike the factor of the throughput above. By
 * roughness alone: by index its variance is infinite, since at the critical angle the score is. */
inline SurfaceStep step_decision_at_boundary(int distribution, INT bsdf, REAL alpha, REAL eta, REAL3 wi, REAL3 m,
                                             REAL reflected, MASK mask) {
  SurfaceStep s = no_surface_step();
  REAL d_alpha, ignored;
  if (distribution == MICROFACET_GGX)
    score_rough_dielectric_decision_ggx(alpha, eta, wi, m, reflected, &d_alpha, &ignored);
  else
    score_rough_dielectric_decision_beckmann(alpha, eta, wi, m, reflected, &d_alpha, &ignored);
  s.bsdf = bsdf;
  s.alpha = SELECT(mask, by_number(d_alpha, alpha), 0.0f);
  return s;
}

/* Adds radiance to the lanes in `mask`, and its derivatives. */
inline void gather_radiance(const Launch* launch, Pool* pool, INT slots, MASK mask,
                            const REAL radiance[RADIANCE_CHANNELS], const Scores* s) {
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c) {
    const REAL x = SELECT(mask, radiance[c], 0.0f);
    STORE(pool, RADIANCE + c, slots, LOAD(pool, RADIANCE + c, slots) + x);
    UNROLL for (int p = 0; p < PARTS; ++p) {
      const int field = DERIVATIVE + parts[p].image * RADIANCE_CHANNELS + c;
      if (parts[p].score[c] >= 0)
        STORE(pool, field, slots,
              LOAD(pool, field, slots) + x * launch->derivatives[p].factor[c] * s->of[parts[p].score[c]]);
    }
  }
}

#endif
