/* A light connection: what it brings, dimmed on its way. Index-matched boundaries and media are passed, anything else blocks
 * it. */
#ifndef ITN_CONNECTION_H
#define ITN_CONNECTION_H
#include "lib/bsdf.h"
#include "lib/emission.h"
#include "lib/homogeneous.h"
#include "lib/light_sampling.h"
#include "lib/phase_score.h"
#include "lib/surface_frame.h"

/* Where a connection begins, and the factors that its own path has there: a passage through a medium, a change of direction
 * by its phase function, a surface. Those of which `medium`, `phase` or `surface` is null are not there. */
typedef struct {
  const Homogeneous* medium;
  const Step* passage;
  const Phase* phase;
  REAL cosine;
  int model; /* of the surface's BSDF; MODEL_none */
  const REAL* n;
  const Step* surface;
  MASK mask;
} ConnectionStart;

inline ConnectionStart connection_start(MASK mask) {
  ConnectionStart s = {0, 0, 0, (REAL)(0.0f), MODEL_none, 0, 0, mask};
  return s;
}

inline void add_connection_start(__global const JobRecord* job, Scores* scores, const ConnectionStart* start) {
  if (start->passage) add_scores(job, scores, MODEL_homogeneous, start->medium->n, start->passage, true);
  if (start->phase) add_phase(job, scores, start->phase, start->cosine, start->mask);
  if (start->surface) add_scores(job, scores, start->model, start->n, start->surface, false);
}

#if ADJOINT
#define PASSAGES MEDIA
/* A connection's own factors weigh what it brings, and nothing else. through: distance in each medium on the way */
inline void pull_connection(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, MASK mask,
                            const REAL arriving[], const ConnectionStart* start, const Lanes through[]) {
  REAL weight[RADIANCE_CHANNELS];
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) weight[c] = arriving[c] * LOAD(pool, PULL + c, slots);
  Scores own = no_scores();
  own.pulled = pulled(weight);
  add_connection_start(job, &own, start);
  if (start->passage) sum_scores(launch, job, pool, slots, &own, MODEL_homogeneous, start->passage->first, mask);
  if (start->phase) sum_phase(launch, job, pool, slots, &own, start->phase, mask);
  if (start->surface) sum_scores(launch, job, pool, slots, &own, start->model, start->surface->first, mask);
  for (int m = 0; m < MEDIA; ++m) {
    const MASK passes = mask & (through[m].real > 0.0f);
    if (!ANY(passes)) continue;
    const Homogeneous medium = load_homogeneous(launch, (INT)(m));
    Step step = no_step(medium.first);
    step_passage(&step, medium.n, through[m].real, passes);
    own.pulled = pulled(weight);
    add_scores(job, &own, MODEL_homogeneous, medium.n, &step, true);
    sum_scores(launch, job, pool, slots, &own, MODEL_homogeneous, medium.first, passes);
  }
}
#else
#define PASSAGES SCORES
#endif

/* What lies between the connection and the light. */
typedef struct {
  Lanes depth[THROUGHPUT_CHANNELS]; /* optical */
  Lanes through[PASSAGES + 1];      /* distance in the medium of each score of sigma_t, or of each medium */
  uint reached;                     /* lanes that nothing blocks */
#if HAS_PASSAGES
  REAL share;              /* of the light that structures on the way let pass */
  REAL passed[SCORES + 1]; /* the scores of that */
#endif
} Obstacles;

/* Is carried[k] a score by sigma_t of a medium? */
inline bool is_of_extinction(int k) {
  return carried[k].model == MODEL_homogeneous && carried[k].slot <= HOMOGENEOUS_sigma_t_last;
}

#if HAS_MEDIUM
/* A lane has passed `distance` in a medium. */
inline void pass_medium(const Launch* launch, __global const JobRecord* job, Obstacles* way, int lane, int medium,
                        float distance) {
  const int first = launch->media[medium].first_number;
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c)
    way->depth[c].f[lane] += launch->numbers[first + HOMOGENEOUS_sigma_t + c] * distance;
  UNROLL_FOR(int k = 0; k < SCORES; ++k)
    if (is_of_extinction(k) && first - job->first_number == carried[k].first) way->through[k].f[lane] += distance;
#if ADJOINT
  way->through[medium].f[lane] += distance;
#endif
}
#endif

/* Moves o, a point on an index-matched boundary, to the side to which the direction d leads. Returns the cosine between d and the
 * outward normal. */
inline float pass_boundary(__global const PrimitiveRecord* primitive, float3 d, float3* o) {
  float3 normal = (float3)(primitive->normal[0], primitive->normal[1], primitive->normal[2]);
  const bool curved = primitive->flags & PRIMITIVE_CURVED;
  if (curved) normal = out_of_curved(primitive, *o);
  float facing = dot(d, normal);
  if (curved && (primitive->flags & PRIMITIVE_FLIPPED)) facing = -facing;
  const float offset = curved ? 0.0f : copysign(primitive->offset, facing);
  *o = (float3)(o->x + offset * normal.x, o->y + offset * normal.y, o->z + offset * normal.z);
  return facing;
}

#if HAS_PASSAGES
/* Where connections meet structures that let a share of the light pass straight on. */
typedef struct {
  INT surface, first; /* of the program; of the numbers */
  REAL3 wi; /* as paths see it that come from the light's side or from the other: shares are the same for both */
  REAL texture[TEXTURE_PLACE];
} Passage;

inline Passage find_passage(const Launch* launch, __global const JobRecord* job, MASK mask, const LaneHits* hits,
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

/* What the lanes at structures of one kind pass on: their share, and their scores. pulled: of a replay, what they weigh; else
 * null. */
inline void pass_structure(int surface, int model, const Launch* launch, __global const JobRecord* job,
                           const Pool* pool, INT slots, const Passage* p, const REAL pulled_weight[], Obstacles* way,
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
  if (pulled_weight == 0) return;
  Scores own = no_scores();
  own.pulled = pulled(pulled_weight);
  add_scores(job, &own, model, n, &step, false);
  sum_scores(launch, job, pool, slots, &own, model, p->first, passes);
#endif
}
#endif

/* Nothing on the way yet. */
inline Obstacles no_obstacles() {
  Obstacles way;
  UNROLL_FOR(int k = 0; k < PASSAGES; ++k) way.through[k].real = (REAL)(0.0f);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) way.depth[c].real = (REAL)(0.0f);
  way.reached = 0;
#if HAS_PASSAGES
  way.share = (REAL)(1.0f);
  UNROLL_FOR(int k = 0; k < SCORES; ++k) way.passed[k] = (REAL)(0.0f);
#endif
  return way;
}

/* What structures that connections meet pass on. Returns the lanes in which something passes. */
inline uint pass_structures(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, MASK mask,
                            const LaneHits* hits, REAL3 to, const REAL pulled_weight[], Obstacles* way) {
#if HAS_PASSAGES
  REAL share = (REAL)(0.0f);
  const Passage at_structure = find_passage(launch, job, mask, hits, to);
#define PASS_STRUCTURE(surface, name, variant) \
  pass_structure(surface, MODEL_##name, launch, job, pool, slots, &at_structure, pulled_weight, way, &share);
  PASSED_SURFACES(PASS_STRUCTURE)
  way->share *= SELECT(share > 0.0f, share, 1.0f);
  return lane_bits(share > 0.0f);
#else
  return 0;
#endif
}

/* Follows connections: from `from` in `medium`, standing on primitive `skip`, towards `to` over `distance`; FAR_AWAY: out of
 * the scene. pulled_weight: of a replay, for what lets light pass straight on; else null. */
inline Obstacles follow_connection(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                                   MASK mask, REAL3 from, REAL3 to, REAL distance, INT skip, INT medium,
                                   const REAL pulled_weight[]) {
  const Surfaces surfaces = job_surfaces(launch, job);
  Obstacles way = no_obstacles();
  Lanes ox, oy, oz, dx, dy, dz, left, stands_on, in;
  ox.real = from.x;
  oy.real = from.y;
  oz.real = from.z;
  dx.real = to.x;
  dy.real = to.y;
  dz.real = to.z;
  left.real = distance;
  stands_on.integer = skip;
  in.integer = medium;
  uint bits = lane_bits(mask);
  MASK passed = (MASK)(0); /* a boundary: nothing behind counts, or thin bodies would be passed again and again */
  while (bits) {
    const LaneHits hits =
        trace_lanes(surfaces, make3(ox.real, oy.real, oz.real), to, HAS_LIGHTS ? left.real : (REAL)(INFINITY),
                    stands_on.integer, in.integer >= 0, passed, mask);
    passed = mask;
    const uint open = pass_structures(launch, job, pool, slots, mask, &hits, to, pulled_weight, &way);
    uint next = 0;
    FOR_EACH_LANE(l, bits) {
      const int at = hits.primitive.i[l], current = in.i[l];
      if (at < 0) { /* nothing opaque or refractive in the way */
        const bool ends = HAS_LIGHTS && left.f[l] < FAR_AWAY;
        if (current < 0 || ends) way.reached |= 1u << l;
#if HAS_MEDIUM && HAS_LIGHTS
        if (current >= 0 && ends) pass_medium(launch, job, &way, l, current, left.f[l]);
#endif
        continue;
      }
      __global const PrimitiveRecord* primitive = launch->primitives + at;
      __global const ShapeRecord* shape = launch->shapes + job->first_shape + primitive->shape;
      if (launch->bsdfs[shape->bsdf].surface != SURFACE_NULL && !(open & (1u << l))) continue;
      float3 o = (float3)(hits.x.f[l], hits.y.f[l], hits.z.f[l]);
      const float facing = pass_boundary(primitive, (float3)(dx.f[l], dy.f[l], dz.f[l]), &o);
      ox.f[l] = o.x;
      oy.f[l] = o.y;
      oz.f[l] = o.z;
#if HAS_MEDIUM
      if (current >= 0) pass_medium(launch, job, &way, l, current, hits.distance.f[l]);
#endif
      if (shape->interior != shape->exterior) in.i[l] = facing < 0.0f ? shape->interior : shape->exterior;
      stands_on.i[l] = at;
#if HAS_LIGHTS
      if (left.f[l] < FAR_AWAY) left.f[l] -= hits.distance.f[l];
#endif
      next |= 1u << l;
    }
    bits = next;
    mask = mask & lane_mask(next);
  }
  return way;
}

/* Adds weight times the light, dimmed on the way, to the radiance of the lanes in `mask`: from `from` in `medium`.
 * scores: of the path so far; start: of where the connection begins. */
inline void add_connection(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK mask,
                           REAL3 from, const LightSample* light, INT skip, INT medium,
                           const REAL weight[RADIANCE_CHANNELS], const Scores* scores, const ConnectionStart* start) {
  REAL arriving[RADIANCE_CHANNELS], dimmed[RADIANCE_CHANNELS];
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) arriving[c] = weight[c] * light->rgb[c];
  const Obstacles way = follow_connection(launch, job, pool, slots, mask, from, light->source.direction,
                                          light->distance, skip, medium, 0);
  if (!way.reached) return;
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    REAL transmittance = EXP(-way.depth[THROUGHPUT_CHANNELS == 1 ? 0 : c].real);
#if HAS_PASSAGES
    transmittance *= way.share;
#endif
    arriving[c] *= transmittance;
    dimmed[c] = weight[c] * transmittance;
  }
  Scores there = *scores;
  add_connection_start(job, &there, start);
  UNROLL_FOR(int k = 0; k < SCORES; ++k) {
    if (!is_of_extinction(k)) continue;
    REAL d[MOST_SLOTS * CHANNELS], ones[MOST_SLOTS]; /* the same whatever sigma_t is */
    UNROLL_FOR(int i = 0; i < MOST_SLOTS; ++i) ones[i] = (REAL)(1.0f);
    score_homogeneous_passage(ones, way.through[k].real, d);
    there.of[k] += d[carried[k].slot * CHANNELS + (CHANNELS == 1 ? 0 : carried[k].channel)];
  }
#if HAS_PASSAGES
  UNROLL_FOR(int k = 0; k < SCORES; ++k) there.of[k] += way.passed[k];
#endif
  const MASK lit = lane_mask(way.reached);
  gather_radiance(launch, pool, slots, lit, arriving, &there);
#if ADJOINT
  if (job->replay) {
    pull_connection(launch, job, pool, slots, lit, arriving, start, way.through);
#if HAS_PASSAGES
    REAL weight_of_all[RADIANCE_CHANNELS];
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) weight_of_all[c] = arriving[c] * LOAD(pool, PULL + c, slots);
    follow_connection(launch, job, pool, slots, lit, from, light->source.direction, light->distance, skip, medium,
                      weight_of_all);
#endif
  }
#endif
  gather_light_derivatives(launch, job, pool, slots, lit, dimmed, &light->source);
}

#endif
