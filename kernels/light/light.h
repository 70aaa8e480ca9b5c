/* The lights that have a place in the scene: model/light/list.h expanded for those that the scene has (LIGHTS_OF_SCENE of the
 * program, runtime/render/compile/surfaces.h), and the points of those that are shapes. */
#ifndef ITN_LIGHT_H
#define ITN_LIGHT_H
#include "texture/numbers.h"
#include "geometry/surface_frame.h"
#include "geometry/surface_point.h"
#include "shared/light_layout.h"

/* A source of light: a light of the scene, or the light around it. */
typedef struct {
  INT index;       /* of the launch's lights; -1: around the scene, from `direction` */
  REAL share[3];   /* times its colour it is what arrives */
  REAL3 direction; /* unit, towards the light */
#if LIGHT_TEXELS
  REAL plain; /* the share but for the picture that tints it */
  REAL uv[2]; /* where the picture was looked up */
#endif
} LightSource;

INLINE LightSource light_source(INT index, REAL3 direction) {
  LightSource source;
  source.index = index;
  source.share[0] = source.share[1] = source.share[2] = (REAL)(0.0f);
  source.direction = direction;
#if LIGHT_TEXELS
  source.plain = source.uv[0] = source.uv[1] = (REAL)(0.0f);
#endif
  return source;
}

INLINE LightSource light_around(REAL3 direction) { return light_source((INT)(-1), direction); }

/* Light drawn for a vertex. */
typedef struct {
  LightSource source; /* its direction */
  REAL distance;      /* FAR_AWAY: no end */
  REAL pdf;           /* > 0: density of the direction [1/sr]; of lights without extent, the probability of the light */
  REAL by_chance;     /* 1: other techniques find it, too; 0: it has no extent */
  REAL rgb[3];        /* radiance from there; without extent, irradiance at right angles */
} LightSample;

#if HAS_LIGHTS
#define LIGHT_WORDS ((int)(sizeof(LightRecord) / sizeof(float)))
#define LIGHT_MEMBER(launch, member) ((__global const float*)(launch)->lights + FIELD_OF(LightRecord, member))
#define LIGHT_MEMBER_INT(launch, member) ((__global const int*)(launch)->lights + FIELD_OF(LightRecord, member))

/* The index where the cumulative shares of the job's lights begin for what is at `from`. */
INLINE INT light_chances(__global const JobRecord* job, REAL3 from) {
  const REAL at[3] = {from.x, from.y, from.z};
  INT cell = (INT)(0);
  UNROLL_FOR(int k = 0; k < 3; ++k) {
    const int cells = job->light_cells[k];
    const REAL place = (at[k] - job->light_low[k]) * job->light_cells_a_unit[k];
    cell = cell * cells + CAST_INT(clamp(place, (REAL)(0.0f), (REAL)(cells - 0.5f)));
  }
  return job->light_chances + cell * (job->lights + 1);
}

/* The light of the job in whose part of [0, 1) u lies. */
INLINE INT pick_light(const Launch* launch, __global const JobRecord* job, INT chances, REAL u) {
  int step = 1;
  while (2 * step < job->lights) step *= 2;
  INT light = (INT)(0);
  for (; step > 0; step /= 2) {
    const INT next = min(light + step, (INT)(job->lights - 1));
    light = SELECT_INT(GATHER(launch->light_tables, chances + next) <= u, next, light);
  }
  return light + job->first_light;
}

/* Probability with which that of the job's lights is drawn. */
INLINE REAL light_chance(const Launch* launch, INT chances, INT light) {
  const INT at = chances + light;
  return GATHER((launch->light_tables + 1), at) - GATHER(launch->light_tables, at);
}

#if HAS_SCREENS
/* Texture coordinates of the point that u0, u1 are of a surface; of lanes in `mask`. */
INLINE void coordinates_on_light(const Launch* launch, INT row, REAL u0, REAL u1, REAL3 on, REAL3 normal, MASK mask,
                                 REAL uv[2]) {
  __global const int* tables = (__global const int*)launch->light_tables;
  __global const float* record = (__global const float*)launch->primitives;
  const INT primitive = SELECT_INT(mask, GATHER_INT((tables + LIGHT_SURFACE_PRIMITIVE), row), 0);
  const INT at = primitive * (int)(sizeof(PrimitiveRecord) / sizeof(float));
  const REAL root = SQRT(u0);
  flat_coordinates(record, at, 1.0f - root, u1 * root, uv);
#if HAS_ROUND
  const INT flags = GATHER_INT(((__global const int*)(record + PRIMITIVE_AT_FLAGS)), at);
  round_coordinates(record, at, flags, on, normal, u0, uv);
#endif
}
#endif

/* A point of each lane's light, uniform over its area, the normal of its front there, and, for lights with a texture, its
 * texture coordinates; anything where it is no shape. */
INLINE void sample_light_surface(const Launch* launch, INT light, REAL u0, REAL u1, REAL u2, REAL3* on, REAL3* normal,
                                 REAL uv[2]) {
  const INT surfaces = GATHER_INT(LIGHT_MEMBER_INT(launch, surfaces), light * LIGHT_WORDS);
  const INT row = choose_surface(launch->light_tables, GATHER_INT(LIGHT_MEMBER_INT(launch, table), light * LIGHT_WORDS),
                                 surfaces, u2);
  point_of_surface(launch->light_tables, row, u0, u1, on, normal);
  uv[0] = uv[1] = (REAL)(0.0f);
#if HAS_SCREENS
  coordinates_on_light(launch, row, u0, u1, *on, *normal, surfaces > 0, uv);
#endif
}

/* The colour of each lane's light. */
INLINE void light_colour(const Launch* launch, INT light, REAL rgb[3]) {
  const INT first = GATHER_INT(LIGHT_MEMBER_INT(launch, first_number), light * LIGHT_WORDS);
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = GATHER((launch->numbers + c), first);
}

/* The slot of LIGHT_TINTED, the first of the numbers that tint the colour. */
#define LIGHT_TINT_SLOT 3

/* The tint of a light at (u, v) of its picture. first: of its numbers */
INLINE void light_tint(const Launch* launch, INT first, const REAL uv[2], REAL rgb[3]) {
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = GATHER((launch->numbers + LIGHT_TINT_SLOT + c), first);
#if HAS_TEXTURE
  Lanes at, u, v, value[3];
  at.integer = first;
  u.real = uv[0];
  v.real = uv[1];
  UNROLL_FOR(int c = 0; c < 3; ++c) value[c].real = rgb[c];
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) {
    const int texture = launch->number_textures[at.i[l] + LIGHT_TINT_SLOT];
    if (texture < 0) continue;
    float tint[3];
    texture_value(launch->textures + texture, launch->texels, launch->numbers + at.i[l] + LIGHT_TINT_SLOT,
                  (TexturePlace){u.f[l], v.f[l]}, tint);
    UNROLL_FOR(int c = 0; c < 3; ++c) value[c].f[l] = tint[c];
  }
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = value[c].real;
#endif
}

#if LIGHT_TEXELS
#define REMEMBER_PLAIN(is, own_share, uv)               \
  source->plain = SELECT(is, own_share, source->plain); \
  source->uv[0] = SELECT(is, uv[0], source->uv[0]);     \
  source->uv[1] = SELECT(is, uv[1], source->uv[1]);
#else
#define REMEMBER_PLAIN(is, own_share, uv)
#endif

/* Computes what each lane's light brings to `from`: see model/light/list.h. */
INLINE void light_arrives(const Launch* launch, INT light, REAL3 from, REAL3 on, REAL3 normal, const REAL on_uv[2],
                          LightSource* source, REAL* distance, MASK* on_shape) {
  REAL nowhere[TEXTURE_PLACE];
  UNROLL_FOR(int k = 0; k < TEXTURE_PLACE; ++k) nowhere[k] = (REAL)(0.0f);
  const INT model = GATHER_INT(LIGHT_MEMBER_INT(launch, model), light * LIGHT_WORDS);
  const INT first = GATHER_INT(LIGHT_MEMBER_INT(launch, first_number), light * LIGHT_WORDS);
  *source = light_source(light, make3((REAL)(0.0f), (REAL)(0.0f), (REAL)(1.0f)));
  *distance = (REAL)(0.0f);
  *on_shape = (MASK)(0);
#define LIGHT_ARRIVES(name, PREFIX)                                                                         \
  {                                                                                                         \
    REAL n[MOST_SLOTS], own_distance, own_share, uv[2] = {on_uv[0], on_uv[1]}, tint[3];                     \
    REAL3 own_towards;                                                                                      \
    load_numbers(launch, MODEL_##name, first, nowhere, n);                                                  \
    name##_arrives(n, from, on, normal, &own_towards, &own_distance, &own_share, uv);                       \
    const MASK is = model == MODEL_##name;                                                                  \
    source->direction = select3(is, own_towards, source->direction);                                        \
    *distance = SELECT(is, own_distance, *distance);                                                        \
    if (PREFIX##_TRAITS & LIGHT_TINTED)                                                                     \
      light_tint(launch, SELECT_INT(is, first, 0), uv, tint);                                               \
    else                                                                                                    \
      tint[0] = tint[1] = tint[2] = (REAL)(1.0f);                                                           \
    UNROLL_FOR(int c = 0; c < 3; ++c) source->share[c] = SELECT(is, own_share * tint[c], source->share[c]); \
    REMEMBER_PLAIN(is, own_share, uv)                                                                       \
    if (PREFIX##_TRAITS & LIGHT_ON_SHAPE) *on_shape = *on_shape | is;                                       \
  }
  LIGHTS_OF_SCENE(LIGHT_ARRIVES)
}

#if HAS_SCREENS
/* The colour that the texture of each lane's light shows at (u, v), where the light is a shape with one. */
INLINE void screen_colour(const Launch* launch, INT light, const REAL uv[2], REAL rgb[3]) {
  const INT model = GATHER_INT(LIGHT_MEMBER_INT(launch, model), light * LIGHT_WORDS);
  const INT first = GATHER_INT(LIGHT_MEMBER_INT(launch, first_number), light * LIGHT_WORDS);
#define SCREEN_COLOUR(name, PREFIX)                                             \
  if ((PREFIX##_TRAITS & LIGHT_ON_SHAPE) && (PREFIX##_TRAITS & LIGHT_TINTED)) { \
    const MASK is = model == MODEL_##name;                                      \
    REAL shown[3];                                                              \
    light_tint(launch, SELECT_INT(is, first, 0), uv, shown);                    \
    UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = SELECT(is, shown[c], rgb[c]);    \
  }
  LIGHTS_OF_SCENE(SCREEN_COLOUR)
}
#endif

/* Is each lane's light one of the scene that is found so (LIGHT_AT_BOUNDARIES ...)? */
INLINE MASK is_reached(const Launch* launch, INT light, int reach) {
  return (light >= 0) & (GATHER_INT(LIGHT_MEMBER_INT(launch, reach), max(light, 0) * LIGHT_WORDS) == reach);
}

#if HAS_AIMED_LIGHTS
/* Does each lane's light come from the same direction everywhere? light: -1: around the scene. */
INLINE MASK is_parallel(const Launch* launch, INT light) {
  const INT model = GATHER_INT(LIGHT_MEMBER_INT(launch, model), max(light, 0) * LIGHT_WORDS);
  MASK parallel = (MASK)(0);
#define FIND_PARALLEL(name, PREFIX) \
  if (PREFIX##_TRAITS & LIGHT_PARALLEL) parallel = parallel | (model == MODEL_##name);
  LIGHTS_OF_SCENE(FIND_PARALLEL)
  return parallel & (light >= 0);
}

/* The probability with which a light is sampled at `from`, as in media. */
INLINE REAL chance_of_light(const Launch* launch, __global const JobRecord* job, REAL3 from, INT light) {
  return job->light_share * light_chance(launch, light_chances(job, from), max(light - job->first_light, 0));
}
#endif

/* Density [1/sr] of a point of the front of a light that is a shape and is drawn with that chance, seen from `distance` under
 * an angle of that cosine. */
INLINE REAL light_surface_pdf(const Launch* launch, INT light, REAL chance, REAL distance, REAL cosine) {
  return chance * GATHER(LIGHT_MEMBER(launch, inverse_area), light * LIGHT_WORDS) * distance * distance /
         MAX(cosine, (REAL)(1e-9f));
}
#endif

#endif
