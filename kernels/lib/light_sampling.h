/* Light sampled at a vertex: which light, in which direction, with which density. Stages that find light by chance weigh it
 * against the same density (MIS, balance heuristic).
 *
 *   lights of the scene (lib/light.h) with probability light_share of the job, else the light around it:
 *   at surfaces       the sun with probability sun_share(), else the sky (or environment map)
 *   in media          the sun alone where there is one: the phase function finds the sky by itself (kernels/README.md)
 *
 * LAST_PDF of a path: its density of DIRECTION at the last vertex [1/sr], over the probability with which light was
 * sampled there; > 0 as in media, < 0 as at surfaces, 0: light was not sampled there. */
#ifndef ITN_LIGHT_SAMPLING_H
#define ITN_LIGHT_SAMPLING_H
#include "lib/environment.h"
#include "lib/launch.h"
#include "lib/light.h"

#if LIGHT_SAMPLING

inline REAL sun_share(__global const EnvironmentRecord* environment, MASK at_surface) {
#if HAS_SUN
  float share = environment->sun_weight / (environment->sun_weight + environment->sky_weight);
  return SELECT(at_surface, clamp(share, 0.1f, 0.9f), 1.0f);
#else
  return (REAL)(0.0f);
#endif
}

/* Density of the sampled directions of the light around the scene [1/sr]. */
inline REAL light_sampling_pdf(const Launch* launch, __global const JobRecord* job, REAL3 direction, MASK at_surface) {
  __global const EnvironmentRecord* environment = launch->environments + job->environment;
  REAL share = sun_share(environment, at_surface);
  REAL pdf = (REAL)(0.0f);
#if HAS_SUN
  pdf = SELECT(in_sun(environment, direction), share * environment->sun_pdf, 0.0f);
#endif
  if (ANY(share < 1.0f)) pdf += (1.0f - share) * smooth_pdf(environment, launch->light_tables, direction);
#if HAS_LIGHTS
  pdf *= 1.0f - job->light_share;
#endif
  return pdf;
}

/* A direction to the light around the scene; u[2] decides between sun and sky. Returns which lanes got one: rounding can put
 * a direction on the rim of the sun's disc just outside it, where the density is 0. */
inline MASK sample_light_around(const Launch* launch, __global const JobRecord* job, MASK at_surface, const REAL u[],
                                LightSample* s) {
  __global const EnvironmentRecord* environment = launch->environments + job->environment;
  REAL share = sun_share(environment, at_surface);
  MASK sun = u[2] < share;
  REAL3 direction;
#if HAS_SUN
  REAL ignored[3];
  sun_sample(environment, launch->light_tables, u[0], u[1], &direction, ignored);
#endif
  if (ANY(!sun)) {
    REAL sky_density;
    const REAL3 sky = smooth_sample(environment, launch->light_tables, u[0], u[1], &sky_density);
#if HAS_SUN
    direction = select3(sun, direction, sky);
#else
    direction = sky;
#endif
  }
  environment_radiance(environment, launch->light_tables, direction, s->rgb);
  const REAL density = light_sampling_pdf(launch, job, direction, at_surface);
  const MASK possible = density > 0.0f;
  s->source = light_around(direction);
  s->distance = (REAL)(FAR_AWAY);
  s->pdf = SELECT(possible, density, 1.0f);
  s->by_chance = (REAL)(1.0f);
  return possible;
}

#if HAS_LIGHTS
/* One of the lights of the scene, chosen by `choice`, uniform in [0, 1), and a point on it where it is a shape. Returns for
 * which lanes it brings something. */
inline MASK sample_light_of_scene(const Launch* launch, __global const JobRecord* job, REAL3 from, const REAL u[],
                                  REAL choice, LightSample* s) {
  const INT chances = light_chances(job, from), light = pick_light(launch, job, chances, choice);
  const REAL chance = light_chance(launch, job, chances, light);
  REAL3 on, normal;
  REAL uv[2];
  sample_light_surface(launch, light, u[0], u[1], u[3], &on, &normal, uv);
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
#endif

/* Light for the vertex at `from`. Returns which lanes got some. What u[2] decides it leaves uniform. */
inline MASK sample_light(const Launch* launch, __global const JobRecord* job, MASK at_surface, REAL3 from, REAL u[],
                         LightSample* s) {
#if HAS_LIGHTS
  const float share = job->light_share;
  const MASK of_scene = u[2] < share;
  const REAL choice = fmin(u[2] / fmax(share, 1e-9f), (REAL)(0.99999994f));
  u[2] = fmin(SELECT(of_scene, choice, (u[2] - share) / fmax(1.0f - share, 1e-9f)), (REAL)(0.99999994f));
  MASK found = (MASK)(0);
  if (ANY(!of_scene)) found = (!of_scene) & sample_light_around(launch, job, at_surface, u, s);
  if (ANY(of_scene)) {
    LightSample own;
    const MASK arrives = of_scene & sample_light_of_scene(launch, job, from, u, choice, &own);
    if (!ANY(!of_scene)) *s = own;
    s->source.index = SELECT_INT(of_scene, own.source.index, s->source.index);
    UNROLL_FOR(int c = 0; c < 3; ++c) s->source.share[c] = SELECT(of_scene, own.source.share[c], s->source.share[c]);
    s->source.direction = select3(of_scene, own.source.direction, s->source.direction);
#if LIGHT_TEXELS
    s->source.plain = SELECT(of_scene, own.source.plain, s->source.plain);
    UNROLL_FOR(int k = 0; k < 2; ++k) s->source.uv[k] = SELECT(of_scene, own.source.uv[k], s->source.uv[k]);
#endif
    s->distance = SELECT(of_scene, own.distance, s->distance);
    s->pdf = SELECT(arrives, own.pdf, SELECT(of_scene, 1.0f, s->pdf));
    s->by_chance = SELECT(of_scene, own.by_chance, s->by_chance);
    UNROLL_FOR(int c = 0; c < 3; ++c) s->rgb[c] = SELECT(of_scene, own.rgb[c], s->rgb[c]);
    found = found | arrives;
  }
  return found;
#else
  return sample_light_around(launch, job, at_surface, u, s);
#endif
}

#endif
#endif
