/* Stage connect: at a scattering vertex in a medium, light is connected: straight through index-matched boundaries, or
 * the sun through a rough one. Then the path goes on in the medium. */
#ifndef ITN_STAGE_CONNECT_H
#define ITN_STAGE_CONNECT_H
#include "lib/light_connection.h"
#include "lib/optical_depth.h"
#include "model/medium_homogeneous.h"
#include "model/phase_henyey_greenstein.h"
#include "stage/boundary.h"

#if MEDIUM_LIGHT_SAMPLING
inline void connect_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  __global const EmitterRecord* emitter = launch->emitters + job->emitter;
  Random random = load_random(job, pool, slots);
  random.event -= 1; /* the event that brought the path here */
  REAL u[4];
  draw(&random, 1, u);
  const REAL3 position = load3(pool, POSITION_X, slots), arrival = load3(pool, ARRIVAL_X, slots);
  const INT medium = SELECT_INT(valid, LOAD_INT(pool, MEDIUM, slots), 0);
  const INT at = medium * (int)(sizeof(MediumRecord) / sizeof(float));
  __global const float* media = (__global const float*)launch->media;
  const REAL g = GATHER((media + FIELD_OF(MediumRecord, g)), at);
  REAL sigma_t[THROUGHPUT_CHANNELS];
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) sigma_t[c] = GATHER((media + FIELD_OF(MediumRecord, sigma_t) + c), at);
  const REAL sigma = mean_sigma_t(sigma_t);
  const REAL chance = LOAD(pool, CHANCE, slots);
  REAL weight[3];
  channel_weights(pool, slots, LOAD(pool, REFRACTION_SCALE, slots) / chance, weight);
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c)
    weight[c] *= LOAD(pool, THROUGHPUT + (THROUGHPUT_CHANNELS == 1 ? 0 : c), slots);

  const Scores scores = load_scores(job, pool, slots);
  REAL3 light;
  REAL light_pdf, rgb[3];
  const MASK sampled = valid & sample_light(launch, emitter, (MASK)(0), u, &light, &light_pdf, rgb);
  MASK straight = sampled;
#if ROUGH_LIGHT_SAMPLING
  const INT connection = GATHER_INT(((__global const int*)media + FIELD_OF(MediumRecord, connection)), at);
  straight = sampled & (connection == CONNECTION_STRAIGHT);
  /* the boundary is one more scattering */
  const MASK refracted = sampled & (connection == CONNECTION_REFRACTED) &
                         (plain_depth(LOAD_INT(pool, DEPTH, slots)) + 1 < job->max_depth);
  if (ANY(refracted)) {
    const AssumedBoundary boundary = assumed_boundary(launch, at);
    const FlightCell cell = flight_cell(launch->grid, launch->geometries + job->geometry, position);
    const REAL3 guess = surface_normal_guess(&cell);
    REAL3 inward;
    const REAL q = sample_refracted(&boundary, guess, light, u[2], u[3], &inward);
    const LaneHits hits = trace_lanes(job_surfaces(launch, job), position, inward, (REAL)(INFINITY), (INT)(-1), refracted,
                                      (MASK)(0), refracted & (q > 0.0f));
    MASK connected = refracted & (hits.primitive.integer >= 0);
    const INT primitive = SELECT_INT(connected, hits.primitive.integer, 0);
    const REAL3 exit = make3(hits.x.real, hits.y.real, hits.z.real);
    REAL3 normal, shading;
    REAL texture[2];
    surface_frame(launch->primitives, primitive, hits.u.real, hits.v.real, exit, &normal, &shading, texture);
    Lanes at_primitive, bsdf, outside, kind, same;
    at_primitive.integer = primitive;
    same.integer = medium;
    UNROLL for (int l = 0; l < WIDTH; ++l) {
      __global const ShapeRecord* shape =
          launch->shapes + job->first_shape + launch->primitives[at_primitive.i[l]].shape;
      bsdf.i[l] = shape->bsdf;
      outside.i[l] = shape->exterior;
      kind.i[l] = shape->interior == same.i[l] ? launch->bsdfs[shape->bsdf].kind : BSDF_NULL;
    }
    const REAL alpha = bsdf_real(launch, bsdf.integer, FIELD_OF(BsdfRecord, alpha));
    const REAL eta = bsdf_real(launch, bsdf.integer, FIELD_OF(BsdfRecord, eta));
    const Frame frame = make_frame(shading);
    const REAL3 wi = scale3(frame_to_local(&frame, inward), -1.0f), wo = frame_to_local(&frame, light);
    connected =
        connected & (wi.z < 0.0f) & (wo.z > 0.0f) & (dot3(light, normal) > 0.0f) & (dot3(inward, normal) > 0.0f);
    REAL value = (REAL)(0.0f);
#if HAS_ROUGH_GGX
    value =
        SELECT(kind.integer == BSDF_ROUGH_GGX, rough_dielectric_eval(MICROFACET_GGX, alpha, 1.0f / eta, wi, wo), value);
#endif
#if HAS_ROUGH_BECKMANN
    value = SELECT(kind.integer == BSDF_ROUGH_BECKMANN,
                   rough_dielectric_eval(MICROFACET_BECKMANN, alpha, 1.0f / eta, wi, wo), value);
#endif
    /* against reaching the exit by the phase function, there then sampling the sun or the BSDF (rough_dielectric.h) */
    const REAL phase = henyey_greenstein(dot3(arrival, inward), g);
    const REAL by_phase = phase * medium_transmittance(sigma, hits.distance.real);
    REAL other = light_pdf;
#if HAS_ROUGH_GGX
    other +=
        SELECT(kind.integer == BSDF_ROUGH_GGX, rough_dielectric_pdf(MICROFACET_GGX, alpha, 1.0f / eta, wi, wo), 0.0f);
#endif
#if HAS_ROUGH_BECKMANN
    other += SELECT(kind.integer == BSDF_ROUGH_BECKMANN,
                    rough_dielectric_pdf(MICROFACET_BECKMANN, alpha, 1.0f / eta, wi, wo), 0.0f);
#endif
    const REAL mis = chance * q * light_pdf / (chance * q * light_pdf + by_phase * other);
    value *= phase * mis / (q * light_pdf);
    REAL connection_weight[RADIANCE_CHANNELS];
    UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c)
      connection_weight[c] = weight[c] * value *
                             bsdf_real(launch, bsdf.integer, FIELD_OF(BsdfRecord, specular_transmittance) + c) *
                             medium_transmittance(sigma_t[THROUGHPUT_CHANNELS == 1 ? 0 : c], hits.distance.real);
    MediumStep in_medium = no_medium_step(medium);
    step_phase(&in_medium, dot3(arrival, inward), g, connected);
    step_passage(&in_medium, sigma_t, hits.distance.real, connected);
    SurfaceStep at_exit = no_surface_step();
#if HAS_ROUGH_GGX
    step_rough_boundary(MICROFACET_GGX, &at_exit, bsdf.integer, alpha, eta, wi, wo,
                        connected & (kind.integer == BSDF_ROUGH_GGX));
#endif
#if HAS_ROUGH_BECKMANN
    step_rough_boundary(MICROFACET_BECKMANN, &at_exit, bsdf.integer, alpha, eta, wi, wo,
                        connected & (kind.integer == BSDF_ROUGH_BECKMANN));
#endif
    add_connection(launch, job, pool, slots, connected & (value > 0.0f),
                   beside_surface(launch->primitives, primitive, exit, normal, light), light, primitive,
                   outside.integer, connection_weight, rgb, &scores, &in_medium, &at_exit);
  }
#endif
  if (ANY(straight)) {
    const REAL phase = henyey_greenstein(dot3(arrival, light), g);
    const REAL value = chance * phase / (chance * light_pdf + phase);
    REAL connection_weight[RADIANCE_CHANNELS];
    UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c) connection_weight[c] = weight[c] * value;
    MediumStep in_medium = no_medium_step(medium);
    const SurfaceStep nowhere = no_surface_step();
    step_phase(&in_medium, dot3(arrival, light), g, straight);
    add_connection(launch, job, pool, slots, straight, position, light, (INT)(-1), medium, connection_weight, rgb, &scores,
                   &in_medium, &nowhere);
  }
  Scores onward = load_scores(job, pool, slots);
  MediumStep turn = no_medium_step(medium);
  step_phase(&turn, dot3(arrival, load3(pool, DIRECTION_X, slots)), g, valid);
  add_phase_step(job, &onward, &turn);
  store_scores(launch, job, pool, slots, &onward, valid);
  push(pool, QUEUE_MEDIUM, slots, valid);
}
#endif

#endif
