/* A light connection: what it brings, dimmed on its way. Index-matched boundaries and media are passed, anything else blocks
 * it. */
#ifndef ITN_CONNECTION_H
#define ITN_CONNECTION_H
#include "path/event_random.h"
#include "scattering/bsdf.h"
#include "light/emission.h"
#include "light/light_sampling.h"
#include "scattering/medium.h"
#include "scattering/phase_score.h"
#include "geometry/surface_frame.h"

/* The beginning of a connection, and the factors that its own path has there: a passage through a medium, a change
 * of direction by its phase function, a surface. A factor with a null `medium`, `phase` or `surface` is absent. */
typedef struct {
  const Medium* medium;
  REAL passage[FIELD_CHANNELS]; /* column density */
#if VOXEL_SUMS
  REAL3 from, direction; /* of the passage: its random numbers are those of segment 1 */
  REAL distance;
#endif
  const Phase* phase;
  REAL cosine;
  int model;               /* of the surface's BSDF; MODEL_none */
  const REAL *n, *texture; /* its numbers, and where they were looked up */
  const Step* surface;
  MASK mask;
} ConnectionStart;

INLINE ConnectionStart connection_start(MASK mask) {
  ConnectionStart s;
  s.medium = 0;
  s.phase = 0;
  s.cosine = (REAL)(0.0f);
  s.model = MODEL_none;
  s.n = 0;
  s.texture = 0;
  s.surface = 0;
  s.mask = mask;
  return s;
}

INLINE void add_connection_start(__global const JobRecord* job, Scores* scores, const ConnectionStart* start) {
  if (start->medium) add_passage(job, scores, start->medium, start->passage, start->mask);
  if (start->phase) add_phase(job, scores, start->phase, start->cosine, start->mask);
  if (start->surface) add_scores(job, scores, start->model, start->n, start->surface, false);
}

#if ADJOINT
#define PASSAGES (MEDIA * FIELD_CHANNELS)
/* A connection's own factors weigh what it brings, and nothing else. through: column density of each medium on the
 * way, FIELD_CHANNELS each */
INLINE void add_connection_adjoint(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                                   const Random* random, MASK mask, const REAL arriving[], const ConnectionStart* start,
                                   const Lanes through[]) {
  REAL weight[RADIANCE_CHANNELS];
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) weight[c] = arriving[c] * LOAD(pool, PIXEL_ADJOINT + c, slots);
#if VOXEL_SUMS
  if (start->medium)
    sum_way_by_voxels(launch, job, pool, slots, start->medium, random, 1, start->from, start->direction,
                      start->distance, mask & start->mask, weight);
  if (start->phase)
    sum_phase_by_voxels(launch, job, pool, slots, start->phase, start->cosine, mask & start->mask, weight);
#endif
  Scores own = no_scores();
  own.adjoint = adjoint_sums(weight);
  add_connection_start(job, &own, start);
  if (start->medium) sum_medium(launch, job, pool, slots, &own, start->medium, mask);
  if (start->phase) sum_phase(launch, job, pool, slots, &own, start->phase, mask);
  if (start->surface)
    sum_scores(launch, job, pool, slots, &own, start->model, start->surface->first, start->texture, mask);
  for (int m = 0; m < MEDIA; ++m) {
    REAL column_density[FIELD_CHANNELS];
    MASK passes = (MASK)(0);
    UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c) {
      column_density[c] = through[m * FIELD_CHANNELS + c].real;
      passes = passes | (mask & (column_density[c] > 0.0f));
    }
    if (!ANY(passes)) continue;
    const Medium medium = load_medium(launch, (INT)(m));
    own.adjoint = adjoint_sums(weight);
    add_passage(job, &own, &medium, column_density, passes);
    sum_medium(launch, job, pool, slots, &own, &medium, passes);
  }
}
#else
#define PASSAGES SCORES
#endif

/* Everything that lies between the connection and the light. */
typedef struct {
  Lanes depth[THROUGHPUT_CHANNELS]; /* optical */
#if HAS_FIELDS
  REAL transmittance[THROUGHPUT_CHANNELS]; /* of media with fields */
#endif
  Lanes through[PASSAGES + 1]; /* column density of the medium of each score of sigma_t, or of each medium */
  uint reached;                /* lanes that nothing blocks */
#if HAS_PASSAGES
  REAL share;              /* of the light that structures on the way let pass */
  REAL passed[SCORES + 1]; /* the scores of that */
#endif
} Obstacles;

#if HAS_MEDIUM
/* A lane has passed `distance` in a medium. */
INLINE void pass_medium(const Launch* launch, __global const JobRecord* job, Obstacles* way, int lane, int medium,
                        float distance) {
  const int first = launch->media[medium].first_number;
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c)
    way->depth[c].f[lane] += launch->numbers[first + MEDIUM_sigma_t + c] * distance;
  UNROLL_FOR(int k = 0; k < SCORES; ++k)
    if (is_of_extinction(k) && first - job->first_number == carried[k].first) way->through[k].f[lane] += distance;
#if ADJOINT
  UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c) way->through[medium * FIELD_CHANNELS + c].f[lane] += distance;
#endif
}

/* The next way of a connection through a medium with a field, a lane each. */
typedef struct {
  Lanes x, y, z, distance, medium;
  uint lanes;
} FieldPassage;

/* A lane passes a way. Those through media with fields are kept for pass_fields. */
INLINE void pass_way(const Launch* launch, __global const JobRecord* job, Obstacles* way, FieldPassage* p, int lane,
                     int medium, float3 from, float distance) {
#if HAS_FIELDS
  if (launch->media[medium].field >= 0) {
    p->lanes |= 1u << lane;
    p->x.f[lane] = from.x;
    p->y.f[lane] = from.y;
    p->z.f[lane] = from.z;
    p->distance.f[lane] = distance;
    p->medium.i[lane] = medium;
    return;
  }
#endif
  pass_medium(launch, job, way, lane, medium, distance);
}
#endif

#if HAS_FIELDS
/* Lanes of a connection in `direction` pass it. segment: how many ways there were before; adjoint_weight: as of
 * follow_connection */
INLINE void pass_fields(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                        Obstacles* way, const Random* random, int segment, REAL3 direction, const FieldPassage* p,
                        const REAL adjoint_weight[]) {
  const MASK mask = lane_mask(p->lanes);
  const REAL3 from = make3(p->x.real, p->y.real, p->z.real);
  const INT index = SELECT_INT(mask, p->medium.integer, 0);
  const Medium medium = load_medium(launch, index);
  if (adjoint_weight) { /* what it passes is known already */
    sum_way_by_voxels(launch, job, pool, slots, &medium, random, segment + 1, from, direction, p->distance.real, mask,
                      adjoint_weight);
    return;
  }
  REAL through[THROUGHPUT_CHANNELS], column_density[FIELD_CHANNELS];
  segment_transmittance(launch, &medium, random, segment, from, direction, p->distance.real, mask, through);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) way->transmittance[c] *= SELECT(mask, through[c], 1.0f);
  segment_column_density(launch, &medium, random, segment + 1, from, direction, p->distance.real, mask, column_density);
  UNROLL_FOR(int k = 0; k < SCORES; ++k)
    if (is_of_extinction(k))
      way->through[k].real += SELECT(mask & (medium.first - job->first_number == carried[k].first),
                                     column_density[FIELD_CHANNELS == 3 ? carried[k].channel : 0], 0.0f);
#if ADJOINT
  Lanes own[FIELD_CHANNELS];
  UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c) own[c].real = column_density[c];
  FOR_EACH_LANE(l, p->lanes)
    UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c)
      way->through[p->medium.i[l] * FIELD_CHANNELS + c].f[l] += own[c].f[l];
#endif
}
#endif

/* Moves o, a point on an index-matched boundary, to the side to which the direction d leads. Returns the cosine between d and the
 * outward normal. */
INLINE float pass_boundary(__global const PrimitiveRecord* primitive, float3 d, float3* o) {
  float3 normal = (float3)(primitive->normal[0], primitive->normal[1], primitive->normal[2]);
  const bool curved = primitive->flags & PRIMITIVE_CURVED;
  if (curved) normal = out_of_curved(primitive, *o);
  float facing = dot(d, normal);
  if (curved && (primitive->flags & PRIMITIVE_FLIPPED)) facing = -facing;
  const float offset = curved ? 0.0f : copysign(primitive->offset, facing);
  *o = (float3)(o->x + offset * normal.x, o->y + offset * normal.y, o->z + offset * normal.z);
  return facing;
}

/* The state of connections on their way. */
typedef struct {
  Lanes x, y, z, dx, dy, dz; /* d: direction */
  Lanes left;                /* distance to the light */
  Lanes stands_on, in;       /* primitive and medium */
#if HAS_MEDIUM
  FieldPassage fields;
#endif
} Follower;

INLINE Follower begin_connection(REAL3 from, REAL3 to, REAL distance, INT skip, INT medium) {
  Follower f;
  f.x.real = from.x;
  f.y.real = from.y;
  f.z.real = from.z;
  f.dx.real = to.x;
  f.dy.real = to.y;
  f.dz.real = to.z;
  f.left.real = distance;
  f.stands_on.integer = skip;
  f.in.integer = medium;
#if HAS_FIELDS
  f.fields.x.real = f.fields.y.real = f.fields.z.real = f.fields.distance.real = (REAL)(0.0f);
#endif
  return f;
}

/* A lane goes on to what its ray has met. open: lets something of it pass? So do index-matched boundaries. Returns whether
 * it goes on behind it. */
INLINE bool follow_lane(const Launch* launch, __global const JobRecord* job, Follower* f, Obstacles* way, int l,
                        const LaneHits* hits, bool open) {
  const int at = hits->primitive.i[l], current = f->in.i[l];
  const float3 from = (float3)(f->x.f[l], f->y.f[l], f->z.f[l]);
  if (at < 0) { /* nothing opaque or refractive in the way */
    const bool ends = HAS_LIGHTS && f->left.f[l] < FAR_AWAY;
    if (current < 0 || ends) way->reached |= 1u << l;
#if HAS_MEDIUM && HAS_LIGHTS
    if (current >= 0 && ends) pass_way(launch, job, way, &f->fields, l, current, from, f->left.f[l]);
#endif
    return false;
  }
  __global const PrimitiveRecord* primitive = launch->primitives + at;
  __global const ShapeRecord* shape = launch->shapes + job->first_shape + primitive->shape;
  if (launch->bsdfs[shape->bsdf].surface != SURFACE_NULL && !open) return false;
  float3 o = (float3)(hits->x.f[l], hits->y.f[l], hits->z.f[l]);
  const float facing = pass_boundary(primitive, (float3)(f->dx.f[l], f->dy.f[l], f->dz.f[l]), &o);
  f->x.f[l] = o.x;
  f->y.f[l] = o.y;
  f->z.f[l] = o.z;
#if HAS_MEDIUM
  if (current >= 0) pass_way(launch, job, way, &f->fields, l, current, from, hits->distance.f[l]);
#endif
  if (shape->interior != shape->exterior) f->in.i[l] = facing < 0.0f ? shape->interior : shape->exterior;
  f->stands_on.i[l] = at;
#if HAS_LIGHTS
  if (f->left.f[l] < FAR_AWAY) f->left.f[l] -= hits->distance.f[l];
#endif
  return true;
}

#if HAS_PASSAGES
/* The places where connections meet structures that let a share of the light pass straight on. */
typedef struct {
  INT surface, first; /* of the program; of the numbers */
  REAL3 wi; /* as paths see it that come from the light's side or from the other: shares are the same for both */
  REAL texture[TEXTURE_PLACE];
} Passage;

INLINE Passage find_passage(const Launch* launch, __global const JobRecord* job, MASK mask, const LaneHits* hits,
                            REAL3 direction) {
  Passage p;
  const INT primitive = SELECT_INT(mask & (hits->primitive.integer >= 0), hits->primitive.integer, 0);
  REAL3 normal, shading;
  surface_frame(launch->primitives, primitive, hits->u.real, hits->v.real,
                make3(hits->x.real, hits->y.real, hits->z.real), &normal, &shading, p.texture);
  const Frame frame = make_frame(shading);
  p.wi = scale3(frame_to_local(&frame, direction), -1.0f);
  Lanes at, surface, first;
  at.integer = primitive;
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) {
    const int bsdf = launch->shapes[job->first_shape + launch->primitives[at.i[l]].shape].bsdf;
    surface.i[l] = launch->bsdfs[bsdf].surface;
    first.i[l] = launch->bsdfs[bsdf].first_number;
  }
  p.surface = SELECT_INT(mask & (hits->primitive.integer >= 0), surface.integer, SURFACE_NULL);
  p.first = first.integer;
  return p;
}

/* Computes what the lanes at structures of one kind pass on: their share, and their scores. adjoint_weight: of a
 * replay, what they weigh; else null. */
INLINE void pass_structure(int surface, int model, const Launch* launch, __global const JobRecord* job,
                           const Pool* pool, INT slots, const Passage* p, const REAL adjoint_weight[], Obstacles* way,
                           REAL* share) {
  const MASK here = p->surface == surface;
  if (!ANY(here)) return;
  REAL n[MOST_SLOTS];
  load_numbers(launch, model, p->first, p->texture, n);
  const REAL passed = bsdf_passage(model, n, p->wi);
  *share = SELECT(here, passed, *share);
  const MASK passes = here & (passed > 0.0f);
  const Step step = bsdf_chosen_step(model, 0, n, p->first, p->wi, scale3(p->wi, -1.0f), passes);
  UNROLL_FOR(int k = 0; k < SCORES; ++k)
    if (carried[k].model == model) way->passed[k] += SELECT(passes, step_of(job, k, &step), 0.0f);
#if ADJOINT
  if (adjoint_weight == 0) return;
  Scores own = no_scores();
  own.adjoint = adjoint_sums(adjoint_weight);
  add_scores(job, &own, model, n, &step, false);
  sum_scores(launch, job, pool, slots, &own, model, p->first, p->texture, passes);
#endif
}
#endif

/* Nothing on the way yet. */
INLINE Obstacles no_obstacles() {
  Obstacles way;
  UNROLL_FOR(int k = 0; k < PASSAGES; ++k) way.through[k].real = (REAL)(0.0f);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) way.depth[c].real = (REAL)(0.0f);
#if HAS_FIELDS
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) way.transmittance[c] = (REAL)(1.0f);
#endif
  way.reached = 0;
#if HAS_PASSAGES
  way.share = (REAL)(1.0f);
  UNROLL_FOR(int k = 0; k < SCORES; ++k) way.passed[k] = (REAL)(0.0f);
#endif
  return way;
}

/* Computes what structures that connections meet pass on. Returns the lanes in which something passes. */
INLINE uint pass_structures(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, MASK mask,
                            const LaneHits* hits, REAL3 to, const REAL adjoint_weight[], Obstacles* way) {
#if HAS_PASSAGES
  REAL share = (REAL)(0.0f);
  const Passage at_structure = find_passage(launch, job, mask, hits, to);
#define PASS_STRUCTURE(surface, name, variant) \
  pass_structure(surface, MODEL_##name, launch, job, pool, slots, &at_structure, adjoint_weight, way, &share);
  PASSED_SURFACES(PASS_STRUCTURE)
  way->share *= SELECT(share > 0.0f, share, 1.0f);
  return lane_bits(share > 0.0f);
#else
  return 0;
#endif
}

/* Follows connections: from `from` in `medium`, standing on primitive `skip`, towards `to` over `distance`; FAR_AWAY: out of
 * the scene. random: of the event; adjoint_weight: of a replay, for what lets light pass straight on; else null. */
INLINE Obstacles follow_connection(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                                   const Random* random, MASK mask, REAL3 from, REAL3 to, REAL distance, INT skip,
                                   INT medium, const REAL adjoint_weight[]) {
  const Surfaces surfaces = job_surfaces(launch, job);
  Obstacles way = no_obstacles();
  Follower f = begin_connection(from, to, distance, skip, medium);
  uint bits = lane_bits(mask);
  int segment = 0;
  MASK passed = (MASK)(0); /* a boundary: nothing behind counts, or thin bodies would be passed again and again */
  while (bits) {
    const LaneHits hits =
        trace_lanes(surfaces, make3(f.x.real, f.y.real, f.z.real), to, HAS_LIGHTS ? f.left.real : (REAL)(INFINITY),
                    f.stands_on.integer, f.in.integer >= 0, passed, mask);
    passed = mask;
    const uint open = pass_structures(launch, job, pool, slots, mask, &hits, to, adjoint_weight, &way);
    uint next = 0;
    ++segment;
#if HAS_FIELDS
    f.fields.lanes = 0;
#endif
    FOR_EACH_LANE(l, bits) {
      if (follow_lane(launch, job, &f, &way, l, &hits, (open & (1u << l)) != 0)) next |= 1u << l;
    }
#if HAS_FIELDS
    if (f.fields.lanes) pass_fields(launch, job, pool, slots, &way, random, segment, to, &f.fields, adjoint_weight);
#endif
    bits = next;
    mask = mask & lane_mask(next);
  }
  return way;
}

/* Adds weight times the light, dimmed on the way, to the radiance of the lanes in `mask`: from `from` in `medium`.
 * scores: of the path so far; start: of where the connection begins; random: numbers of the event, of which media may take
 * streams of their own. */
INLINE void add_connection(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots,
                           const Random* random, MASK mask, REAL3 from, const LightSample* light, INT skip, INT medium,
                           const REAL weight[RADIANCE_CHANNELS], const Scores* scores, const ConnectionStart* start) {
  REAL arriving[RADIANCE_CHANNELS], dimmed[RADIANCE_CHANNELS];
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) arriving[c] = weight[c] * light->rgb[c];
  const Obstacles way = follow_connection(launch, job, pool, slots, random, mask, from, light->source.direction,
                                          light->distance, skip, medium, 0);
  if (!way.reached) return;
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    const int t = THROUGHPUT_CHANNELS == 1 ? 0 : c;
    REAL transmittance = EXP(-way.depth[t].real);
#if HAS_FIELDS
    transmittance *= way.transmittance[t];
#endif
#if HAS_PASSAGES
    transmittance *= way.share;
#endif
    arriving[c] *= transmittance;
    dimmed[c] = weight[c] * transmittance;
  }
  Scores there = *scores;
  add_connection_start(job, &there, start);
  UNROLL_FOR(int k = 0; k < SCORES; ++k) {
    if (is_of_extinction(k)) there.of[k] += score_of_passage(k, way.through[k].real);
  }
#if HAS_PASSAGES
  UNROLL_FOR(int k = 0; k < SCORES; ++k) there.of[k] += way.passed[k];
#endif
  const MASK lit = lane_mask(way.reached);
  gather_radiance(launch, job, pool, slots, lit, arriving, &there);
#if ADJOINT
  if (job->replay == REPLAY_SUMS) {
    add_connection_adjoint(launch, job, pool, slots, random, lit, arriving, start, way.through);
#if HAS_PASSAGES || VOXEL_SUMS
    REAL weight_of_all[RADIANCE_CHANNELS];
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
      weight_of_all[c] = arriving[c] * LOAD(pool, PIXEL_ADJOINT + c, slots);
    follow_connection(launch, job, pool, slots, random, lit, from, light->source.direction, light->distance, skip,
                      medium, weight_of_all);
#endif
  }
#endif
  gather_light_derivatives(launch, job, pool, slots, lit, dimmed, &light->source);
}

#endif
