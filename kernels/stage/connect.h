/* Stage connect: at a scattering vertex in a medium, light is connected: straight through index-matched boundaries and to
 * lights inside of the body, or the sun, bright regions of the surroundings and lights without extent through a rough boundary.
 * Then the path goes on in the medium. */
#ifndef ITN_STAGE_CONNECT_H
#define ITN_STAGE_CONNECT_H
#include "path/event_random.h"
#include "path/spectral.h"
#include "stage/boundary.h"

#if MEDIUM_LIGHT_SAMPLING
/* A scattering vertex that waits for light. */
typedef struct {
  INT medium;
  REAL3 position, arrival; /* arrival: direction of travel before the scattering */
  REAL chance;             /* with which it got here */
  REAL weight[3];          /* throughput with all its factors, over chance */
  Medium inside;
  Phase phase;
} LitVertex;

INLINE LitVertex load_lit_vertex(const Launch* launch, const Pool* pool, INT slots, MASK valid) {
  LitVertex x;
  x.position = load3(pool, POSITION, slots);
  x.arrival = load3(pool, ARRIVAL, slots);
  x.medium = SELECT_INT(valid, LOAD_INT(pool, MEDIUM, slots), 0);
  x.inside = load_medium(launch, x.medium);
  x.phase = load_phase(launch, x.medium);
  place_phase(launch, &x.phase, x.position, valid);
  x.chance = LOAD(pool, CHANCE, slots);
  channel_weights(pool, slots, LOAD(pool, REFRACTION_SCALE, slots) / x.chance, x.weight);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
    x.weight[c] *= LOAD(pool, THROUGHPUT + (THROUGHPUT_CHANNELS == 1 ? 0 : c), slots);
  return x;
}

#if REFRACTED_CONNECTIONS
/* The place where a connection leaves the medium through a rough boundary. */
typedef struct {
  LaneHits hits;
  INT primitive, first_number, exterior, surface;
  REAL3 position, normal, inward; /* inward: direction of the connection inside */
  REAL3 shading;                  /* normal */
  REAL3 wi, wo;
  REAL texture[TEXTURE_PLACE];
  REAL density; /* with which `inward` was drawn */
  REAL drawn;   /* density with which the exit draws the light's direction, as LightSample.pdf */
  MASK found;
} Exit;

/* Random numbers for directions inside, where the point of a light that is a shape takes those of the light. */
enum { STREAM_INWARD = 0x83 };

/* light: drawn for the vertex */
INLINE Exit find_exit(const Launch* launch, __global const JobRecord* job, const LitVertex* x, const LightSample* light,
                      const REAL u[4], MASK refracted) {
  Exit e;
  const AssumedBoundary boundary = assumed_boundary(launch, x->medium * (int)(sizeof(MediumRecord) / sizeof(float)));
  const FlightCell cell = flight_cell(launch->grid, launch->geometries + job->geometry, x->position);
#if HAS_AIMED_LIGHTS
  const REAL3 aim = aim_at_light(launch, job, &cell, x->position, &light->source, x->position, light->distance);
#else
  const REAL3 aim = light->source.direction;
#endif
  e.density = sample_refracted(&boundary, surface_normal_guess(&cell), aim, u[2], u[3], &e.inward);
  e.hits = trace_lanes(job_surfaces(launch, job), x->position, e.inward, (REAL)(INFINITY), (INT)(-1), refracted,
                       (MASK)(0), refracted & (e.density > 0.0f));
  e.found = refracted & (e.hits.primitive.integer >= 0);
  e.drawn = light->pdf;
  e.primitive = SELECT_INT(e.found, e.hits.primitive.integer, 0);
  e.position = make3(e.hits.x.real, e.hits.y.real, e.hits.z.real);
  surface_frame(launch->primitives, e.primitive, e.hits.u.real, e.hits.v.real, e.position, &e.normal, &e.shading,
                e.texture);
  Lanes primitive, first_number, exterior, surface, inside;
  primitive.integer = e.primitive;
  inside.integer = x->medium;
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) {
    __global const ShapeRecord* shape = launch->shapes + job->first_shape + launch->primitives[primitive.i[l]].shape;
    first_number.i[l] = launch->bsdfs[shape->bsdf].first_number;
    exterior.i[l] = shape->exterior;
    surface.i[l] = shape->interior == inside.i[l] ? launch->bsdfs[shape->bsdf].surface : SURFACE_NULL;
  }
  e.first_number = first_number.integer;
  e.exterior = exterior.integer;
  e.surface = surface.integer;
  return e;
}

/* The light's direction at the exit is known. */
INLINE void leave_towards(Exit* e, REAL3 light) {
  const Frame frame = make_frame(e->shading);
  e->wi = scale3(frame_to_local(&frame, e->inward), -1.0f);
  e->wo = frame_to_local(&frame, light);
  e->found = e->found & (e->wi.z < 0.0f) & (e->wo.z > 0.0f) & (dot3(light, e->normal) > 0.0f) &
             (dot3(e->inward, e->normal) > 0.0f);
}

#if HAS_AIMED_LIGHTS
/* A light that is aimed at is sampled whether it shines on the vertex or not. Returns for which lanes; u[2], which chose it, is
 * uniform again. */
INLINE MASK take_aimed(const Launch* launch, __global const JobRecord* job, const LitVertex* x, MASK valid, REAL u[],
                       LightSample* light) {
  const MASK aimed = valid & is_reached(launch, light->source.index, LIGHT_AIMED_AT);
  const INT chances = light_chances(job, x->position), own = max(light->source.index - job->first_light, 0);
  const REAL chance = light_chance(launch, chances, own);
  const REAL place = (u[2] - GATHER(launch->light_tables, chances + own)) / MAX(chance, (REAL)(1e-9f));
  u[2] = SELECT(aimed, clamp(place, (REAL)(0.0f), (REAL)(0.99999994f)), u[2]);
  light->pdf = SELECT(aimed, job->light_share * chance, light->pdf);
  return aimed;
}

/* Computes what the light that was aimed at brings to the exit. u: the numbers with which it was drawn */
INLINE void light_exit(const Launch* launch, __global const JobRecord* job, MASK aimed, const REAL u[], Exit* e,
                       LightSample* light) {
  const INT index = SELECT_INT(aimed, light->source.index, job->first_light);
  REAL3 on = e->position, normal = e->normal;
  REAL uv[2] = {(REAL)(0.0f), (REAL)(0.0f)};
#if HAS_AIMED_SHAPES
  sample_light_surface(launch, index, u[0], u[1], u[3], &on, &normal, uv);
#endif
  LightSample there;
  const MASK brings = light_from_point(launch, index, on, normal, uv, e->position, light->pdf, &there);
  /* densities are proportional to the chance of the light */
  const REAL drawn = there.pdf * (chance_of_light(launch, job, e->position, index) / light->pdf);
  e->drawn = SELECT(aimed, drawn, e->drawn);
  e->found = e->found & (!aimed | brings);
  take_light(aimed, &there, light);
}
#endif

/* Connects with light through the exits at surfaces of one BSDF. */
INLINE void connect_through(int surface, int model, int variant, const Launch* launch, __global const JobRecord* job,
                            Pool* pool, INT slots, const Random* random, const LitVertex* x, const Exit* e,
                            const LightSample* sample, const Scores* scores) {
  const int traits = bsdf_traits(model);
  if (!(traits & BSDF_TRANSMITS) || (traits & (BSDF_SMOOTH | BSDF_BROAD))) return;
  const MASK here = e->found & (e->surface == surface);
  if (!ANY(here)) return;
  REAL n[MOST_SLOTS], f[CHANNELS];
  load_numbers(launch, model, e->first_number, e->texture, n);
  REAL3 wi = e->wi, wo = e->wo;
  if (traits & BSDF_ANISOTROPIC) {
    const Frame frame =
        make_frame_along(e->shading, surface_tangent(launch->primitives, e->primitive, e->position, e->normal));
    bsdf_bump(model, launch, e->primitive, e->position, e->normal, &frame, n);
    wi = scale3(frame_to_local(&frame, e->inward), -1.0f);
    wo = frame_to_local(&frame, sample->source.direction);
  }
  bsdf_value(model, variant, n, wi, wo, f);
  const REAL sigma = typical_sigma_t(&x->inside);
  /* against reaching the exit by the phase function, there then sampling the sun or the BSDF (boundary.h) */
  const REAL cosine = dot3(x->arrival, e->inward);
  const REAL phase = phase_value(&x->phase, cosine);
  const REAL by_phase = phase * medium_transmittance(sigma, e->hits.distance.real);
  const REAL light_pdf = sample->pdf, other = e->drawn + sample->by_chance * bsdf_density(model, variant, n, wi, wo);
  const REAL mis = x->chance * e->density * light_pdf / (x->chance * e->density * light_pdf + by_phase * other);
  REAL connection_weight[RADIANCE_CHANNELS], passed[THROUGHPUT_CHANNELS];
  segment_transmittance(launch, &x->inside, random, 0, x->position, e->inward, e->hits.distance.real, here, passed);
  MASK lit = (MASK)(0);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    const int t = THROUGHPUT_CHANNELS == 1 ? 0 : c;
    REAL value = f[t];
    value *= phase * mis / (e->density * light_pdf);
    lit = lit | (value > 0.0f);
    connection_weight[c] = x->weight[c] * value * passed[t];
  }
  const Step at_exit = bsdf_step(model, variant, n, e->first_number, wi, wo, here);
  ConnectionStart start = connection_start(here);
  start.medium = &x->inside;
  segment_column_density(launch, &x->inside, random, 1, x->position, e->inward, e->hits.distance.real, here,
                         start.passage);
#if VOXEL_SUMS
  start.from = x->position;
  start.direction = e->inward;
  start.distance = e->hits.distance.real;
#endif
  start.phase = &x->phase;
  start.cosine = cosine;
  start.model = model;
  start.n = n;
  start.texture = e->texture;
  start.surface = &at_exit;
  add_connection(launch, job, pool, slots, random, here & lit,
                 beside_surface(launch->primitives, e->primitive, e->position, e->normal, sample->source.direction),
                 sample, e->primitive, e->exterior, connection_weight, scores, &start);
}
#endif

/* Straight through index-matched boundaries. */
INLINE void connect_straight(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots,
                             const Random* random, MASK straight, const LitVertex* x, const LightSample* light,
                             const Scores* scores) {
  const REAL cosine = dot3(x->arrival, light->source.direction);
  const REAL phase = phase_value(&x->phase, cosine);
  const REAL value = x->chance * phase / (x->chance * light->pdf + light->by_chance * phase);
  REAL connection_weight[RADIANCE_CHANNELS];
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) connection_weight[c] = x->weight[c] * value;
  ConnectionStart start = connection_start(straight);
  start.phase = &x->phase;
  start.cosine = cosine;
  add_connection(launch, job, pool, slots, random, straight, x->position, light, (INT)(-1), x->medium,
                 connection_weight, scores, &start);
}

INLINE void connect_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  Random random = load_random(job, pool, slots);
  random.event -= 1; /* the event that brought the path here */
  REAL u[4];
  draw(&random, 1, u);
  const LitVertex x = load_lit_vertex(launch, pool, slots, valid);
  const Scores scores = load_scores(job, pool, slots);
  LightSample light;
  const MASK sampled = valid & sample_light(launch, job, x.position, u, &light);
  MASK straight = sampled;
#if ROUGH_LIGHT_SAMPLING || HAS_INNER_LIGHTS
  const INT connection = GATHER_INT(((__global const int*)launch->media + FIELD_OF(MediumRecord, connection)),
                                    x.medium * (int)(sizeof(MediumRecord) / sizeof(float)));
  straight = sampled & (connection == CONNECTION_STRAIGHT);
#if HAS_INNER_LIGHTS
  straight = straight | (sampled & is_reached(launch, light.source.index, LIGHT_INSIDE));
#endif
#if REFRACTED_CONNECTIONS
  MASK reached = REFRACTED_AROUND ? sampled & (light.source.index < 0) : (MASK)(0);
#if HAS_AIMED_LIGHTS
  const MASK aimed = take_aimed(launch, job, &x, valid & (connection == CONNECTION_REFRACTED), u, &light);
  reached = reached | aimed;
#endif
  /* the boundary is one more scattering */
  const MASK refracted =
      reached & (connection == CONNECTION_REFRACTED) & (plain_depth(LOAD_INT(pool, DEPTH, slots)) + 1 < job->max_depth);
  if (ANY(refracted)) {
    REAL inward[4] = {u[0], u[1], u[2], u[3]};
#if HAS_AIMED_SHAPES
    draw(&random, STREAM_INWARD, inward);
#endif
    Exit exit = find_exit(launch, job, &x, &light, inward, refracted);
#if HAS_AIMED_LIGHTS
    light_exit(launch, job, aimed & refracted, u, &exit, &light);
#endif
    leave_towards(&exit, light.source.direction);
#define CONNECT_THROUGH(surface, name, variant) \
  connect_through(surface, MODEL_##name, variant, launch, job, pool, slots, &random, &x, &exit, &light, &scores);
    SURFACE_LIST(CONNECT_THROUGH)
  }
#endif
#endif
#if HAS_UNLIT_MEDIA
  const INT lit_by_all = GATHER_INT(((__global const int*)launch->media + FIELD_OF(MediumRecord, sample_emitters)),
                                    x.medium * (int)(sizeof(MediumRecord) / sizeof(float)));
  straight = straight & ((lit_by_all != 0) | (light.by_chance > 0.0f));
#endif
  if (ANY(straight)) connect_straight(launch, job, pool, slots, &random, straight, &x, &light, &scores);
  Scores onward = load_scores(job, pool, slots);
  const REAL cosine = dot3(x.arrival, load3(pool, DIRECTION, slots));
  add_phase(job, &onward, &x.phase, cosine, valid);
#if VOXEL_SUMS
  if (job->replay == REPLAY_SUMS)
    sum_phase_by_voxels(launch, job, pool, slots, &x.phase, cosine, valid, onward.adjoint.weight);
#endif
  store_scores(pool, slots, &onward);
  sum_phase(launch, job, pool, slots, &onward, &x.phase, valid);
  push(pool, QUEUE_MEDIUM, slots, valid);
}
#endif

#endif
