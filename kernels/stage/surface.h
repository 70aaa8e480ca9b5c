/* Common code of the stages of all surfaces: where the path has arrived, in which frame, and how it goes on. */
#ifndef ITN_STAGE_SURFACE_H
#define ITN_STAGE_SURFACE_H
#include "geometry/frame.h"
#include "path/launch.h"
#include "geometry/surface_frame.h"
#include "stage/ray.h"

typedef struct {
  REAL3 position, direction;               /* direction of travel on arrival */
  REAL3 normal;                            /* geometric, unit, outward */
  REAL3 frame;                             /* shading normal, unit */
  REAL texture[TEXTURE_PLACE];             /* geometry/surface_frame.h */
  MASK front;                              /* arrives from outside */
  INT primitive, first_number, first_cell; /* of the BSDF */
  MASK twosided;
  INT interior, exterior; /* media */
#if HAS_AREA_LIGHTS
  INT light; /* of the launch, -1: the shape is none */
#endif
  MASK misplaced; /* logically on the side it cannot come from: a position off by rounding, or shapes that overlap; the
                     boundary is passed as if it were not there, and the path is on its logical side again */
} Surface;

/* opaque: light never passes it. Then what arrives from behind tells no fault: a floor in a fog is there for both sides,
 * and names the medium of one. */
INLINE Surface load_surface(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                            MASK valid, bool opaque) {
  Surface s;
  s.position = load3(pool, POSITION, slots);
  s.direction = load3(pool, DIRECTION, slots);
  s.primitive = SELECT_INT(valid, LOAD_INT(pool, HIT, slots), 0);
  surface_frame(launch->primitives, s.primitive, LOAD(pool, HIT_PLACE, slots), LOAD(pool, HIT_PLACE + 1, slots),
                s.position, &s.normal, &s.frame, s.texture);
  Lanes primitive, first_number, first_cell, twosided, interior, exterior, light;
  primitive.integer = s.primitive;
#if HAS_HIDDEN_LIGHTS
  Lanes depth;
  depth.integer = LOAD_INT(pool, DEPTH, slots);
#endif
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) {
    __global const ShapeRecord* shape = launch->shapes + job->first_shape + launch->primitives[primitive.i[l]].shape;
    __global const BsdfRecord* bsdf = launch->bsdfs + shape->bsdf;
    first_number.i[l] = bsdf->first_number;
    first_cell.i[l] = bsdf->first_cell;
    twosided.i[l] = bsdf->twosided;
    interior.i[l] = shape->interior;
    exterior.i[l] = shape->exterior;
    light.i[l] = shape->light;
#if HAS_HIDDEN_LIGHTS
    if (is_hidden(launch, job, job->first_shape + launch->primitives[primitive.i[l]].shape, depth.i[l]))
      interior.i[l] = exterior.i[l] = -1; /* the medium around goes on */
#endif
  }
  s.first_number = first_number.integer;
  s.first_cell = first_cell.integer;
  s.twosided = twosided.integer != 0;
  s.interior = interior.integer;
  s.exterior = exterior.integer;
#if HAS_AREA_LIGHTS
  s.light = light.integer;
#endif
  s.front = dot3(s.direction, s.normal) < 0.0f;
  INT medium = LOAD_INT(pool, MEDIUM, slots);
  s.misplaced = valid & (interior.integer != exterior.integer) &
                (medium == SELECT_INT(s.front, interior.integer, exterior.integer));
  const uint strays = lane_bits(opaque ? s.misplaced & s.front : s.misplaced);
  if (strays) atomic_add(launch->misplaced, popcount(strays));
  return s;
}

/* The medium above or below the surface, for a path in one of them. */
INLINE INT medium_behind(const Pool* pool, INT slots, const Surface* s, MASK above) {
  const INT beyond = SELECT_INT(above, s->exterior, s->interior);
  return SELECT_INT(s->interior == s->exterior, LOAD_INT(pool, MEDIUM, slots), beyond);
}

/* On with `direction` from the surface, into the medium on that side. As in Mitsuba, a shape with no media of its own
 * leaves the path in the medium it is in. */
INLINE void leave_surface(const Launch* launch, Pool* pool, INT slots, MASK mask, const Surface* s, REAL3 direction) {
  const MASK inward = dot3(direction, s->normal) < 0.0f;
  INT medium = LOAD_INT(pool, MEDIUM, slots);
  medium = SELECT_INT(s->interior == s->exterior, medium, SELECT_INT(inward, s->interior, s->exterior));
  store3(pool, POSITION, slots, beside_surface(launch->primitives, s->primitive, s->position, s->normal, direction));
  store3(pool, DIRECTION, slots, direction);
  STORE_INT(pool, MEDIUM, slots, medium);
  STORE_INT(pool, SKIP, slots, s->primitive);
  STORE_INT(pool, PASSED, slots, 0);
  push(pool, QUEUE_RAY, slots, mask & (medium < 0));
#if HAS_MEDIUM
  push(pool, QUEUE_MEDIUM, slots, mask & (medium >= 0));
#endif
}

#endif
