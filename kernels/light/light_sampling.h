/* Light sampled at a vertex: which light, in which direction, with which density. Stages that find light by chance weigh it
 * against the same density (MIS, balance heuristic). Of light around the scene that has a sun the sun alone is sampled: the
 * path's own directions find the sky (kernels/README.md). In media this goes for all jobs of a program in which some have a sun.
 *
 *   in media and at boundaries that they lie behind: one direction (sample_light), to one of the lights of the scene
 *                     (light/light.h) with probability light_share of the job, else to the light around it
 *   at other surfaces: several directions to each, of which one is connected (stage/light_choice.h); their density is the
 *                     sum of all of theirs
 *
 * LAST_PDF of a path: its density of DIRECTION at the last vertex [1/sr], over the probability with which light was
 * sampled there; > 0 as in media, < 0 as at surfaces, 0: light was not sampled there. */
#ifndef ITN_LIGHT_SAMPLING_H
#define ITN_LIGHT_SAMPLING_H
#include "light/sun.h"
#include "light/environment.h"
#include "path/launch.h"
#include "light/light.h"

#if LIGHT_SAMPLING

/* Directions drawn at a surface to the lights of the scene, and to the light around it. */
#define LAMP_CANDIDATES 1
#define MAP_CANDIDATES 4
INLINE int candidates_around(__global const EnvironmentRecord* environment) {
  return environment->sun_pdf > 0 ? 1 : MAP_CANDIDATES;
}

/* The probability of sampling the light around the scene, where the scene has lights, too. */
INLINE REAL share_around(__global const JobRecord* job, MASK at_surface) {
#if HAS_LIGHTS
  return SELECT(at_surface, job->light_share < 1.0f ? 1.0f : 0.0f, 1.0f - job->light_share);
#else
  return (REAL)(1.0f);
#endif
}

/* Density of the sampled directions of the light around the scene [1/sr]. */
INLINE REAL light_sampling_pdf(const Launch* launch, __global const JobRecord* job, REAL3 direction, MASK at_surface) {
  __global const EnvironmentRecord* environment = launch->environments + job->environment;
  REAL pdf = (REAL)(0.0f);
#if HAS_SUN
  if (environment->sun_pdf > 0) pdf = SELECT(in_sun(environment, direction), (REAL)(environment->sun_pdf), 0.0f);
  const REAL candidates = SELECT(at_surface, environment->sun_pdf > 0 ? 0.0f : MAP_CANDIDATES, 0.0f);
#else
  const REAL candidates = SELECT(at_surface, MAP_CANDIDATES, 1.0f);
#endif
  if (ANY(candidates > 0.0f)) pdf += candidates * smooth_pdf(environment, launch->light_tables, direction);
  return pdf * share_around(job, at_surface);
}

/* A direction to the light around the scene. Returns which lanes got one: rounding can put a direction on the rim of the sun's
 * disc just outside it, where the density is 0. */
INLINE MASK sample_light_around(const Launch* launch, __global const JobRecord* job, bool at_surface, REAL u0, REAL u1,
                                LightSample* s) {
  __global const EnvironmentRecord* environment = launch->environments + job->environment;
  const bool sun = HAS_SUN && (!at_surface || environment->sun_pdf > 0);
  REAL3 direction;
  REAL ignored[3], density;
  if (sun)
    sun_sample(environment, launch->light_tables, u0, u1, &direction, ignored);
  else
    direction = smooth_sample(environment, launch->light_tables, u0, u1, &density);
  environment_radiance(environment, launch->light_tables, direction, s->rgb);
  if (sun || !at_surface)
    density = light_sampling_pdf(launch, job, direction, (MASK)(at_surface ? -1 : 0));
  else /* the same but for rounding; many are drawn */
    density *= MAP_CANDIDATES * share_around(job, (MASK)(-1));
  const MASK possible = density > 0.0f;
  s->source = light_around(direction);
  s->distance = (REAL)(FAR_AWAY);
  s->pdf = SELECT(possible, density, 1.0f);
  s->by_chance = (REAL)(1.0f);
  return possible;
}

#if HAS_LIGHTS
/* Computes what a light of the scene brings to a place, from the point `on` of it if it is a shape (normal and uv
 * there). chance: the probability with which it was picked. Returns for which lanes it brings something. */
INLINE MASK light_from_point(const Launch* launch, INT light, REAL3 on, REAL3 normal, const REAL uv[], REAL3 from,
                             REAL chance, LightSample* s) {
  MASK on_shape;
  light_arrives(launch, light, from, on, normal, uv, &s->source, &s->distance, &on_shape);
  light_colour(launch, light, s->rgb);
  UNROLL_FOR(int c = 0; c < 3; ++c) s->rgb[c] *= s->source.share[c];
  s->by_chance = SELECT(on_shape, 1.0f, 0.0f);
  s->pdf = SELECT(on_shape, light_surface_pdf(launch, light, chance, s->distance, -dot3(s->source.direction, normal)),
                  chance);
#if LIGHT_TEXELS
  const REAL brings = s->source.plain; /* a black texel has a derivative, too */
#else
  const REAL brings = MAX(s->source.share[0], MAX(s->source.share[1], s->source.share[2]));
#endif
  return (brings > 0.0f) & (s->pdf > 0.0f) & (s->pdf < 1e30f);
}

/* One of the lights of the scene, chosen by `choice`, uniform in [0, 1), and a point on it where it is a shape, by u[0], u[1] and
 * u[3]. share: how often it is done. Returns for which lanes it brings something. */
INLINE MASK sample_light_of_scene(const Launch* launch, __global const JobRecord* job, float share, REAL3 from,
                                  const REAL u[], REAL choice, LightSample* s) {
  const INT chances = light_chances(job, from), light = pick_light(launch, job, chances, choice);
  const REAL chance = share * light_chance(launch, chances, light - job->first_light);
  REAL3 on, normal;
  REAL uv[2];
  sample_light_surface(launch, light, u[0], u[1], u[3], &on, &normal, uv);
  return light_from_point(launch, light, on, normal, uv, from, chance, s);
}
#endif

/* *s where `mask` says so. */
INLINE void take_light(MASK mask, const LightSample* other, LightSample* s) {
  s->source.index = SELECT_INT(mask, other->source.index, s->source.index);
  UNROLL_FOR(int c = 0; c < 3; ++c) s->source.share[c] = SELECT(mask, other->source.share[c], s->source.share[c]);
  s->source.direction = select3(mask, other->source.direction, s->source.direction);
#if LIGHT_TEXELS
  s->source.plain = SELECT(mask, other->source.plain, s->source.plain);
  UNROLL_FOR(int k = 0; k < 2; ++k) s->source.uv[k] = SELECT(mask, other->source.uv[k], s->source.uv[k]);
#endif
  s->distance = SELECT(mask, other->distance, s->distance);
  s->pdf = SELECT(mask, other->pdf, s->pdf);
  s->by_chance = SELECT(mask, other->by_chance, s->by_chance);
  UNROLL_FOR(int c = 0; c < 3; ++c) s->rgb[c] = SELECT(mask, other->rgb[c], s->rgb[c]);
}

/* Light for the vertex at `from`, as in media. Returns which lanes got some. What u[2] decides it leaves uniform. */
INLINE MASK sample_light(const Launch* launch, __global const JobRecord* job, REAL3 from, REAL u[], LightSample* s) {
#if HAS_LIGHTS
  const float share = job->light_share;
  const MASK of_scene = u[2] < share;
  const REAL choice = fmin(u[2] / fmax(share, 1e-9f), (REAL)(0.99999994f));
  u[2] = fmin(SELECT(of_scene, choice, (u[2] - share) / fmax(1.0f - share, 1e-9f)), (REAL)(0.99999994f));
  MASK found = (MASK)(0);
  if (ANY(!of_scene)) found = (!of_scene) & sample_light_around(launch, job, false, u[0], u[1], s);
  if (ANY(of_scene)) {
    LightSample own;
    const MASK arrives = of_scene & sample_light_of_scene(launch, job, share, from, u, choice, &own);
    own.pdf = SELECT(arrives, own.pdf, 1.0f);
    if (!ANY(!of_scene)) *s = own;
    take_light(of_scene, &own, s);
    found = found | arrives;
  }
  return found;
#else
  return sample_light_around(launch, job, false, u[0], u[1], s);
#endif
}

#endif
#endif
