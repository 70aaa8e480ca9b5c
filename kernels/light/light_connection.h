/* Light connections of scattering vertices in media: when they are tried, and in which direction through a rough
 * boundary.
 *
 * Light from few directions (the sun, bright regions of a picture, lights without extent) through a rough boundary: a
 * direction that refracts to it is drawn at the scattering vertex, not at the boundary (design: kernels/README.md, "Sun
 * through a rough boundary"). The exit and its normal are guessed from the vertex alone: those of the nearest surface. A
 * microfacet normal about the guess refracts the direction from there to the light into the medium. Unbiased with any guess;
 * the microfacet density nearly cancels. */
#ifndef ITN_LIGHT_CONNECTION_H
#define ITN_LIGHT_CONNECTION_H
#include "light/sun.h"
#include "geometry/frame.h"
#include "light/light_sampling.h"
#include "scattering/phase.h"
#include "model/bsdf/rough_dielectric.h"

/* Is the light around the scene sampled through rough boundaries: its sun, or bright regions of its picture? */
#define REFRACTED_AROUND (HAS_SUN || HAS_PEAKS)
/* Are there lights of which the direction is known, or nearly, before the place at which they pass a rough boundary? */
#define REFRACTED_CONNECTIONS (ROUGH_LIGHT_SAMPLING && (REFRACTED_AROUND || HAS_AIMED_LIGHTS))

#if MEDIUM_LIGHT_SAMPLING
#define CHANCE_FLOOR 0.02f
#define CHANCE_SCALE 0.25f
#define CHANCE_ANYWHERE 0.12f
#define CHANCE_OF_LIGHTS 1.0f
#define CHANCE_IN_FIELDS 6.0f
/* Probability of trying a connection from a scattering vertex, proportional to what is expected of it: throughput, phase
 * function towards the sun's middle (refracted at the nearest surface), and transmittance over the least distance to a
 * surface. Rays are what a connection costs; a vertex deep inside, or one whose light arrives from behind, rarely pays for
 * them. Any value above 0 is unbiased: the path keeps it, since MIS divides by it.
 *   at: of the media's records, in floats; cell: of the vertex; arrival: direction of travel before the scattering */
INLINE REAL connection_chance(const Launch* launch, __global const JobRecord* job, INT at, const FlightCell* cell,
                              REAL3 arrival, REAL throughput, REAL sigma_t, const Phase* phase) {
  const REAL distance = surface_distance(launch->geometries + job->geometry, cell);
  const REAL3 normal = surface_normal_guess(cell);
  REAL expected = CHANCE_ANYWHERE * EXP(-sigma_t * distance);
#if HAS_LIGHTS
  /* lights may be inside, where the surface is of no concern */
  if (job->lights > 0) expected = CHANCE_OF_LIGHTS * (HAS_INNER_LIGHTS ? (REAL)(1.0f) : EXP(-sigma_t * distance));
#endif
#if HAS_SUN
  __global const EnvironmentRecord* environment = launch->environments + job->environment;
  __global const float* sun = environment->sun_direction;
  REAL3 towards = make3((REAL)(sun[0]), (REAL)(sun[1]), (REAL)(sun[2]));
  const REAL facing = dot3(towards, normal);
#if ROUGH_LIGHT_SAMPLING
  __global const float* media = (__global const float*)launch->media;
  const MASK refracted =
      GATHER_INT(((__global const int*)media + FIELD_OF(MediumRecord, connection)), at) == CONNECTION_REFRACTED;
  const REAL inverse_eta = SELECT(refracted, 1.0f / GATHER((media + FIELD_OF(MediumRecord, eta)), at), 1.0f);
  const REAL cosine = SQRT(MAX(1.0f - (1.0f - facing * facing) * inverse_eta * inverse_eta, (REAL)(0.0f)));
  towards = add3(scale3(towards, inverse_eta), scale3(normal, SELECT(refracted, cosine - facing * inverse_eta, 0.0f)));
#endif
  /* cosine between the connection and the normal of the surface through which it leaves */
  const REAL along = MAX(dot3(towards, normal), (REAL)(0.25f));
  expected = MAX(expected, (CHANCE_SCALE * 12.566371f) * phase_value(phase, dot3(arrival, towards)) *
                               SELECT(facing > 0.0f, 1.0f, 0.3f) * EXP(-sigma_t * distance / along));
#endif
#if HAS_FIELDS
  /* A straight line out of a grid costs little beside flights with their null collisions, and grids often thin out on the way. */
  __global const int* of_media = (__global const int*)launch->media;
  const MASK straight_out_of_field =
      (GATHER_INT((of_media + FIELD_OF(MediumRecord, field)), at) >= 0) &
      (GATHER_INT((of_media + FIELD_OF(MediumRecord, connection)), at) != CONNECTION_REFRACTED);
  expected *= SELECT(straight_out_of_field, CHANCE_IN_FIELDS, 1.0f);
#endif
  return MAX((REAL)(CHANCE_FLOOR), MIN((REAL)(0.999f), throughput * expected));
}
#endif

#if ROUGH_LIGHT_SAMPLING
/* The boundary that the guess assumes for each lane's medium. */
typedef struct {
  INT distribution;
  REAL alpha, eta; /* eta: inside over outside */
} AssumedBoundary;

/* at: of the media's records, in floats */
INLINE AssumedBoundary assumed_boundary(const Launch* launch, INT at) {
  __global const float* media = (__global const float*)launch->media;
  AssumedBoundary b;
  b.distribution = GATHER_INT(((__global const int*)media + FIELD_OF(MediumRecord, distribution)), at);
  b.alpha = GATHER((media + FIELD_OF(MediumRecord, alpha)), at);
  b.eta = GATHER((media + FIELD_OF(MediumRecord, eta)), at);
  return b;
}

#if HAS_AIMED_LIGHTS
/* From the exit that the guess assumes for a vertex in `cell`, the direction to the point of a light that lies in the source's
 * direction at `distance` from `place`. Of light around the scene, and of parallel light, it is the source's. */
INLINE REAL3 aim_at_light(const Launch* launch, __global const JobRecord* job, const FlightCell* cell, REAL3 vertex,
                          const LightSource* source, REAL3 place, REAL distance) {
  const REAL depth = surface_distance(launch->geometries + job->geometry, cell);
  const REAL3 exit = add3(vertex, scale3(surface_normal_guess(cell), depth));
  const REAL3 way = add3(sub3(place, exit), scale3(source->direction, distance));
  const REAL3 aim = scale3(way, 1.0f / SQRT(MAX(dot3(way, way), (REAL)(1e-20f))));
  return select3(is_parallel(launch, source->index) | (source->index < 0), source->direction, aim);
}
#endif

/* Density of microfacet normals per solid angle, D(h) cos, about the guess. */
INLINE REAL assumed_normals(const AssumedBoundary* b, REAL3 h) {
  const REAL ggx = ggx_normals(h, b->alpha), beckmann = beckmann_normals(h, b->alpha);
  return SELECT(b->distribution == MICROFACET_GGX, ggx, beckmann) * h.z;
}

/* Draws a direction inside, from the vertex towards the boundary, that a microfacet about the guessed normal refracts
 * from `light` (outside, towards the light). Returns its density [1/sr], 0: none. */
INLINE REAL sample_refracted(const AssumedBoundary* b, REAL3 guess, REAL3 light, REAL u0, REAL u1, REAL3* direction) {
  const REAL a2 = b->alpha * b->alpha;
  const REAL tan2 = SELECT(b->distribution == MICROFACET_GGX, a2 * u0 / (1.0f - u0), -a2 * LOG(1.0f - u0));
  const REAL cosine = 1.0f / SQRT(1.0f + tan2), sine = SQRT(tan2) * cosine;
  REAL s, c;
  sin_cos_2pi(u1, &s, &c);
  const Frame frame = make_frame(guess);
  const REAL3 in_frame = make3(sine * c, sine * s, cosine), h = frame_to_world(&frame, in_frame);
  const REAL light_h = dot3(light, h);
  REAL fresnel, cos_t;
  fresnel_dielectric_refract(MIN(ABS(light_h), (REAL)(1.0f)), b->eta, &fresnel, &cos_t);
  /* towards the vertex: -light / eta + (light.h / eta - cos_t) h; the path goes the other way */
  *direction = add3(scale3(light, 1.0f / b->eta), scale3(h, cos_t - light_h / b->eta));
  const REAL inside_h = -cos_t, d = light_h + b->eta * inside_h;
  const REAL density = assumed_normals(b, in_frame) * b->eta * b->eta * cos_t / MAX(d * d, (REAL)(1e-12f));
  return SELECT((light_h > 0.0f) & (cos_t > 0.0f), density, 0.0f);
}

/* The density with which sample_refracted draws `direction`. */
INLINE REAL refracted_pdf(const AssumedBoundary* b, REAL3 guess, REAL3 light, REAL3 direction) {
  REAL3 h = sub3(scale3(direction, b->eta), light);
  h = scale3(h, 1.0f / SQRT(MAX(dot3(h, h), (REAL)(1e-20f))));
  REAL light_h = dot3(light, h);
  h = scale3(h, SELECT(dot3(h, guess) < 0.0f, -1.0f, 1.0f));
  light_h = dot3(light, h);
  const REAL inside_h = -dot3(direction, h);
  const Frame frame = make_frame(guess);
  const REAL3 in_frame = frame_to_local(&frame, h);
  const REAL d = light_h + b->eta * inside_h;
  const REAL density = assumed_normals(b, in_frame) * b->eta * b->eta * ABS(inside_h) / MAX(d * d, (REAL)(1e-12f));
  return SELECT((light_h > 0.0f) & (inside_h < 0.0f) & (in_frame.z > 0.0f), density, 0.0f);
}

#if HAS_AIMED_SHAPES
/* Density of the connection through an exit (stage/connect.h) to a point that shines, over that of sampling light at the exit,
 * where the path has gone that way. */
INLINE REAL aimed_competing_pdf(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                                MASK mask, REAL3 place, const LightSource* source) {
  const MASK from_exit =
      mask & (LOAD(pool, LAST_PDF_DIVISOR, slots) < 0.0f) & is_reached(launch, source->index, LIGHT_AIMED_AT);
  if (!ANY(from_exit)) return (REAL)(0.0f);
  const REAL3 vertex = load3(pool, EXIT_VERTEX, slots), exit = load3(pool, ORIGIN, slots);
  const REAL3 way = sub3(exit, vertex), inward = scale3(way, 1.0f / SQRT(MAX(dot3(way, way), (REAL)(1e-20f))));
  const INT medium = SELECT_INT(from_exit, LOAD_INT(pool, EXIT_MEDIUM, slots), 0);
  const AssumedBoundary boundary = assumed_boundary(launch, medium * (int)(sizeof(MediumRecord) / sizeof(float)));
  const FlightCell cell =
      flight_cell(launch->grid, launch->geometries + job->geometry, select3(from_exit, vertex, place));
  const REAL3 aim = aim_at_light(launch, job, &cell, vertex, source, place, (REAL)(0.0f));
  const REAL density = refracted_pdf(&boundary, surface_normal_guess(&cell), aim, inward) *
                       chance_of_light(launch, job, vertex, source->index) /
                       MAX(chance_of_light(launch, job, exit, source->index), (REAL)(1e-9f));
  return SELECT(from_exit, density / MAX(LOAD(pool, EXIT_DENSITY, slots), (REAL)(1e-30f)), 0.0f);
}
#endif
#endif

#endif
