/* Light sampled at a vertex: which light, in which direction, with which density. The escape stage weighs what it finds
 * by chance against the same density (MIS, balance heuristic).
 *
 *   at surfaces       the sun with probability sun_share(), else the sky (or environment map)
 *   in media          the sun alone where there is one: the phase function finds the sky by itself (kernels/README.md)
 *
 * LAST_PDF of a path: its density of DIRECTION at the last vertex [1/sr], over the probability with which light was
 * sampled there; > 0 as in media, < 0 as at surfaces, 0: light was not sampled there. */
#ifndef ITN_LIGHT_SAMPLING_H
#define ITN_LIGHT_SAMPLING_H
#include "lib/emitter.h"
#include "lib/launch.h"

inline void emitter_radiance(const Launch* launch, __global const EmitterRecord* emitter, REAL3 direction,
                             REAL rgb[3]) {
  emitter_sky_radiance(emitter, launch->emitter_tables, direction, rgb);
#if HAS_SUN
  REAL sun[3];
  MASK inside = emitter_sun_radiance(emitter, launch->emitter_tables, direction, sun);
  UNROLL for (int c = 0; c < 3; ++c) rgb[c] += SELECT(inside, sun[c], 0.0f);
#endif
}

#if LIGHT_SAMPLING

inline REAL sun_share(__global const EmitterRecord* emitter, MASK at_surface) {
#if HAS_SUN
  float share = emitter->sun_weight / (emitter->sun_weight + emitter->sky_weight);
  return SELECT(at_surface, clamp(share, 0.1f, 0.9f), 1.0f);
#else
  return (REAL)(0.0f);
#endif
}

/* Density of the sampled light directions [1/sr]. */
inline REAL light_sampling_pdf(const Launch* launch, __global const EmitterRecord* emitter, REAL3 direction,
                               MASK at_surface) {
  REAL share = sun_share(emitter, at_surface);
  REAL pdf = (REAL)(0.0f);
#if HAS_SUN
  pdf = SELECT(emitter_in_sun(emitter, direction), share * emitter->sun_pdf, 0.0f);
#endif
  if (ANY(share < 1.0f)) pdf += (1.0f - share) * sky_pdf(emitter, launch->emitter_tables, direction);
  return pdf;
}

/* Draws a direction; *pdf > 0; rgb: radiance of all light from there. Returns which lanes got one: rounding can put a
 * direction on the rim of the sun's disc just outside it, where the density is 0. */
inline MASK sample_light(const Launch* launch, __global const EmitterRecord* emitter, MASK at_surface, const REAL u[3],
                         REAL3* direction, REAL* pdf, REAL rgb[3]) {
  REAL share = sun_share(emitter, at_surface);
  MASK sun = u[2] < share;
#if HAS_SUN
  REAL ignored[3];
  sun_sample(emitter, launch->emitter_tables, u[0], u[1], direction, ignored);
#endif
  if (ANY(!sun)) {
    REAL3 sky;
    REAL sky_density, sky_rgb[3];
    sky_sample(emitter, launch->emitter_tables, u[0], u[1], &sky, &sky_density, sky_rgb);
#if HAS_SUN
    *direction = select3(sun, *direction, sky);
#else
    *direction = sky;
#endif
  }
  emitter_radiance(launch, emitter, *direction, rgb);
  const REAL density = light_sampling_pdf(launch, emitter, *direction, at_surface);
  const MASK possible = density > 0.0f;
  *pdf = SELECT(possible, density, 1.0f);
  return possible;
}

#endif
#endif
