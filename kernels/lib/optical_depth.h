/* What dims a light connection on its way: index-matched boundaries and media are passed, anything else blocks it. */
#ifndef ITN_OPTICAL_DEPTH_H
#define ITN_OPTICAL_DEPTH_H
#include "lib/emission.h"
#include "lib/score.h"

#if ADJOINT
#define PASSAGES MEDIA
/* A connection's own factors weigh what it brings, and nothing else. through: distance in each medium on the way */
inline void pull_connection(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, MASK mask,
                            const REAL arriving[], const MediumStep* medium_step, const SurfaceStep* surface_step,
                            const Lanes through[]) {
  REAL weight[RADIANCE_CHANNELS];
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c) weight[c] = arriving[c] * LOAD(pool, PULL + c, slots);
  Scores own = no_scores();
  own.pulled = pulled(weight);
  add_flight_step(job, &own, medium_step);
  add_phase_step(job, &own, medium_step);
  add_pulled(launch, job, pool, slots, mask, &own.pulled);
  own.pulled = pulled(weight);
  add_surface_step(job, &own, surface_step);
  add_pulled(launch, job, pool, slots, mask, &own.pulled);
  for (int m = 0; m < MEDIA; ++m) {
    const MASK passes = mask & (through[m].real > 0.0f);
    if (!ANY(passes)) continue;
    MediumStep step = no_medium_step((INT)(m));
    REAL sigma_t[THROUGHPUT_CHANNELS];
    UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) sigma_t[c] = (REAL)(launch->media[m].sigma_t[c]);
    step_passage(&step, sigma_t, through[m].real, passes);
    own.pulled = pulled(weight);
    add_flight_step(job, &own, &step);
    add_pulled(launch, job, pool, slots, passes, &own.pulled);
  }
}
#else
#define PASSAGES SCORES
#endif

/* Adds weight * light, dimmed on the way, to the radiance of the lanes in `mask`: from `from` in `medium` towards `to`.
 * light: the radiance from there; scores: of the path so far; medium_step, surface_step: of where the connection begins. */
inline void add_connection(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK mask,
                           REAL3 from, REAL3 to, INT skip, INT medium, const REAL weight[RADIANCE_CHANNELS],
                           const REAL light[3], const Scores* scores, const MediumStep* medium_step,
                           const SurfaceStep* surface_step) {
  const Surfaces surfaces = job_surfaces(launch, job);
  REAL arriving[RADIANCE_CHANNELS];
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c) arriving[c] = weight[c] * light[c];
  Lanes ox, oy, oz, dx, dy, dz, stands_on, in, depth[THROUGHPUT_CHANNELS];
  Lanes through[PASSAGES + 1]; /* distance in the medium of each score of sigma_t */
  ox.real = from.x;
  oy.real = from.y;
  oz.real = from.z;
  dx.real = to.x;
  dy.real = to.y;
  dz.real = to.z;
  stands_on.integer = skip;
  in.integer = medium;
  UNROLL for (int k = 0; k < PASSAGES; ++k) through[k].real = (REAL)(0.0f);
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) depth[c].real = (REAL)(0.0f);
  uint bits = lane_bits(mask), reached = 0;
  MASK passed = (MASK)(0); /* a boundary: nothing behind counts, or thin bodies would be passed again and again */
  while (bits) {
    const LaneHits hits = trace_lanes(surfaces, make3(ox.real, oy.real, oz.real), to, (REAL)(INFINITY),
                                      stands_on.integer, in.integer >= 0, passed, mask);
    passed = mask;
    uint next = 0;
    FOR_EACH_LANE(l, bits) {
      const int at = hits.primitive.i[l], current = in.i[l];
      if (at < 0) { /* nothing opaque or refractive in the way */
        if (current < 0) reached |= 1u << l;
        continue;
      }
      __global const PrimitiveRecord* primitive = launch->primitives + at;
      __global const ShapeRecord* shape = launch->shapes + job->first_shape + primitive->shape;
      if (launch->bsdfs[shape->bsdf].kind != BSDF_NULL) continue;
      const float3 o = (float3)(hits.x.f[l], hits.y.f[l], hits.z.f[l]), d = (float3)(dx.f[l], dy.f[l], dz.f[l]);
      float3 normal = (float3)(primitive->normal[0], primitive->normal[1], primitive->normal[2]);
      const bool sphere = primitive->flags & PRIMITIVE_SPHERE;
      if (sphere) normal = o - normal;
      float facing = dot(d, normal);
      if (sphere && (primitive->flags & PRIMITIVE_FLIPPED)) facing = -facing;
      const float offset = sphere ? 0.0f : copysign(primitive->offset, facing);
      ox.f[l] = o.x + offset * normal.x;
      oy.f[l] = o.y + offset * normal.y;
      oz.f[l] = o.z + offset * normal.z;
#if HAS_MEDIUM
      if (current >= 0) {
        UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c)
          depth[c].f[l] += launch->media[current].sigma_t[c] * hits.distance.f[l];
        UNROLL for (int k = 0; k < SCORES; ++k)
          if (carried[k].kind == SCORE_SIGMA_T && current - job->first_medium == carried[k].target)
            through[k].f[l] += hits.distance.f[l];
#if ADJOINT
        through[current].f[l] += hits.distance.f[l];
#endif
      }
#endif
      if (shape->interior != shape->exterior) in.i[l] = facing < 0.0f ? shape->interior : shape->exterior;
      stands_on.i[l] = at;
      next |= 1u << l;
    }
    bits = next;
    mask = mask & lane_mask(next);
  }
  if (!reached) return;
  REAL dimmed[RADIANCE_CHANNELS];
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c) {
    const REAL transmittance = EXP(-depth[THROUGHPUT_CHANNELS == 1 ? 0 : c].real);
    arriving[c] *= transmittance;
    dimmed[c] = weight[c] * transmittance;
  }
  Scores there = *scores;
  add_flight_step(job, &there, medium_step);
  add_phase_step(job, &there, medium_step);
  add_surface_step(job, &there, surface_step);
  UNROLL for (int k = 0; k < SCORES; ++k) {
    if (carried[k].kind != SCORE_SIGMA_T) continue;
    REAL d;
    score_medium_passage((REAL)(1.0f), through[k].real, &d); /* whatever sigma_t is */
    there.of[k] += d;
  }
  gather_radiance(launch, pool, slots, lane_mask(reached), arriving, &there);
#if ADJOINT
  if (job->replay) pull_connection(launch, job, pool, slots, lane_mask(reached), arriving, medium_step, surface_step, through);
#endif
  gather_light_derivatives(launch, job, pool, slots, lane_mask(reached), dimmed, to);
}

#endif
