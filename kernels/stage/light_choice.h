/* Light for a vertex at a surface: of several candidates, drawn towards each kind of light, one is connected, in proportion to
 * what it would bring if nothing blocked it. So the one ray that a connection costs goes where this surface, seen from here,
 * needs it. Candidates are weighed against each other and against the path's own direction by the balance heuristic; what
 * is chosen stands for all (resampled importance sampling: Talbot, Cline, Egbert 2005, doi:10.2312/EGWR/EGSR05/139-146).
 * Any choice is unbiased that may fall on each candidate that brings something. */
#ifndef ITN_STAGE_LIGHT_CHOICE_H
#define ITN_STAGE_LIGHT_CHOICE_H
#include "path/event_random.h"
#include "light/light_sampling.h"
#include "stage/reflector.h"

#if LIGHT_SAMPLING
enum { STREAM_LIGHT_CHOICE = 0x82 };

/* The contribution that is expected of a light with that weight: its luminance, and `least` in proportion to how
 * often it is drawn, since derivatives by the light need black ones, too. */
INLINE REAL expected_light(const LightSample* s, float least, const REAL weight[RADIANCE_CHANNELS]) {
  const float luminance[3] = {0.212671f, 0.715160f, 0.072169f};
  REAL sum = (REAL)(0.0f);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) /* the sky has negative channels */
    sum += (RADIANCE_CHANNELS == 1 ? 1.0f : luminance[c]) * weight[c] * (ABS(s->rgb[c]) + least * s->pdf);
  return sum;
}

/* Candidate k of those towards the light around the scene. shift: two numbers in (0, 1), the same for all. */
INLINE MASK candidate_around(const Launch* launch, __global const JobRecord* job, int k, const REAL shift[],
                             LightSample* s) {
  REAL u0 = shift[0], u1 = shift[1];
  if (k > 0) { /* spread evenly: a lattice */
    u0 += (float)k / MAP_CANDIDATES;
    u1 += (float)k * 0.618034f;
    u0 -= floor(u0);
    u1 -= floor(u1);
  }
  return sample_light_around(launch, job, true, u0, u1, s);
}

/* Computes what the candidate brings: `factor`, what the path weighs, times the BSDF, over the density of all ways
 * to it. */
INLINE void weigh_candidate(int model, int variant, const Launch* launch, const Surface* s, Reflector* r,
                            const LightSample* light, MASK possible, const REAL factor[RADIANCE_CHANNELS],
                            REAL weight[RADIANCE_CHANNELS]) {
  const REAL3 wo = frame_to_local(&r->frame, light->source.direction);
  bsdf_measure(model, launch, r->n, r->wi, wo);
  const REAL bsdf_pdf = bsdf_density(model, variant, r->n, r->wi, wo);
  REAL f[CHANNELS];
  bsdf_value(model, variant, r->n, r->wi, wo, f);
  const int traits = bsdf_traits(model);
  const bool even = (traits & BSDF_EVEN) != 0;
  const bool one_side = (traits & BSDF_TRANSMITS) != 0 && (traits & (BSDF_THIN | BSDF_STRUCTURE)) == 0;
  if (one_side) possible = possible & (dot3(light->source.direction, s->normal) > 0.0f);
  const REAL scale = SELECT(possible, 1.0f / (light->pdf + light->by_chance * bsdf_pdf), 0.0f);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
    weight[c] = factor[c] * (even ? bsdf_pdf : f[THROUGHPUT_CHANNELS == 1 ? 0 : c]) * scale;
}

/* Returns which lanes have light to connect with; weight: what its radiance is to be multiplied by. */
INLINE MASK choose_light(int model, int variant, const Launch* launch, __global const JobRecord* job, const Surface* s,
                         Reflector* r, const Random* random, const REAL factor[RADIANCE_CHANNELS], LightSample* chosen,
                         REAL weight[RADIANCE_CHANNELS]) {
  REAL v[4];
  draw(random, 1, v);
  __global const EnvironmentRecord* environment = launch->environments + job->environment;
  int around = candidates_around(environment), lamps = 0;
  /* brighter light chooses alike */
  const float brightness = environment->sun_weight + environment->sky_weight;
  const float least = 0.01f * (brightness > 0 ? brightness : 1.0f);
#if HAS_LIGHTS
  if (!(job->light_share < 1.0f)) around = 0;
  if (job->lights > 0) lamps = LAMP_CANDIDATES;
#endif
  REAL sum = (REAL)(0.0f), own = (REAL)(1.0f), u = v[2];
  if (around > 0 && lamps > 0) { /* v[2] says which lamp */
    REAL w[4];
    draw(random, STREAM_LIGHT_CHOICE, w);
    u = w[0];
  }
  chosen->source = light_around(s->normal);
  chosen->distance = (REAL)(FAR_AWAY);
  chosen->pdf = chosen->by_chance = (REAL)(1.0f);
  UNROLL_FOR(int c = 0; c < 3; ++c) chosen->rgb[c] = (REAL)(0.0f);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) weight[c] = (REAL)(0.0f);
  for (int k = 0; k < around + lamps; ++k) {
    LightSample candidate;
    MASK possible;
#if HAS_LIGHTS
    if (k >= around)
      possible = sample_light_of_scene(launch, job, LAMP_CANDIDATES, s->position, v, v[2], &candidate);
    else
#endif
      possible = candidate_around(launch, job, k, v, &candidate);
    REAL brings[RADIANCE_CHANNELS];
    weigh_candidate(model, variant, launch, s, r, &candidate, possible, factor, brings);
    const REAL expected = expected_light(&candidate, least, brings);
    sum += expected;
    const REAL share = expected / MAX(sum, (REAL)(1e-30f));
    const MASK takes = u < share;
    u = SELECT(takes, u / MAX(share, (REAL)(1e-30f)), (u - share) / MAX(1.0f - share, (REAL)(1e-9f)));
    take_light(takes, &candidate, chosen);
    own = SELECT(takes, expected, own);
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) weight[c] = SELECT(takes, brings[c], weight[c]);
  }
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) weight[c] *= sum / own;
  return sum > 0.0f;
}
#endif

#endif
