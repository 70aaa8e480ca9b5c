/* The closest surface along a ray.
 *
 * Nothing leaks. The edge tests of a triangle (Woop, Benthin, Wald: Watertight Ray/Triangle Intersection, 2013) look at
 * vertices in coordinates that depend on ray and vertex alone, so two triangles see a shared edge with exactly opposite
 * numbers, and as products are rounded one by one, the sign is right or the value 0, which counts as a hit. Boxes are
 * wider than the rounding errors of their test. What remains is where a ray starts: a position lies only nearly on its
 * surface, or nearly in front of the next one. Four measures:
 *   - a returned position is computed on its primitive and kept a few roundings away from a triangle's edges;
 *   - a path goes on from a surface an `offset` beside it, on the side to which it goes (beside_surface() in
 *     geometry/surface_frame.h);
 *   - what comes so close to a surface that rounding could put it on the other side counts as meeting it;
 *   - `inside` tells which side of a surface a consistent path meets next: all surfaces count as moved by their
 *     tolerance so that the path is on the right side of them. */
#ifndef ITN_TRACE_H
#define ITN_TRACE_H
#include "geometry/box_vector.h"
#include "shared/geometry_layout.h"

typedef struct {
  __global const float* nodes;
  __global const float* leaves;
  __global const PrimitiveRecord* primitives;
  __global const GeometryRecord* record;
} Surfaces;

typedef struct {
  float t;       /* distance [units of the direction] */
  float u, v;    /* barycentric coordinates of a triangle's second and third vertex */
  float x, y, z; /* position on the surface, more exact than origin + t * direction: go on beside_surface() */
  int primitive; /* index into Surfaces.primitives, -1: no hit; the other members are then undefined */
  int front;     /* 1: the ray enters, against the outward normal, 0: it leaves */
} Hit;

typedef struct {
  float3 origin, direction;
  float side;  /* +1: inside, -1: outside; 0: nothing behind the origin counts */
  bool inside; /* the path expects to leave */
} Ray;

INLINE Surfaces surfaces_of(__global const float* nodes, __global const float* leaves,
                            __global const PrimitiveRecord* primitives, __global const GeometryRecord* record) {
  Surfaces s;
  s.nodes = nodes + record->first_node;
  s.leaves = leaves + record->first_leaf;
  s.primitives = primitives;
  s.record = record;
  return s;
}

/* A vertex coordinate across the ray. */
INLINE BoxFloat sheared(BoxFloat coordinate, BoxFloat slope, BoxFloat depth) { return coordinate - slope * depth; }

/* Twice the signed area of (origin, a, b). Antisymmetric, and never of the wrong sign: must not become a fused
 * operation. */
INLINE BoxFloat edge_function(BoxFloat ax, BoxFloat ay, BoxFloat bx, BoxFloat by) {
#pragma OPENCL FP_CONTRACT OFF
  const BoxFloat p = ax * by;
  const BoxFloat q = bx * ay;
  return p - q;
}

/* One lane of RaySetup, seen along its longest axis kz. */
typedef struct {
  int kx, ky, kz; /* offsets of these axes in a block */
  float ox, oy, oz;
  float sx, sy, sz; /* slopes of the direction over kz, and the inverse of its component along kz */
} Shear;

/* The found hit while the walk goes on. */
typedef struct {
  float limit; /* of the walk: t_max or the hit */
  float t, u, v;
  int primitive, front;
  bool round;                 /* no triangle */
  __global const float* lane; /* of the block */
} Found;

/* BOX_WIDTH pairs of a triangle and a ray; a member that all pairs share is broadcast. Vertices and origin are in the
 * order of Shear's axes. */
typedef struct {
  BoxFloat u, v, w, det; /* edge functions and their sum */
  BoxFloat az, bz, cz;   /* depth of the vertices */
} Crossing;

__attribute__((always_inline)) INLINE BoxInt crosses(const BoxFloat vertex[9], BoxFloat ox, BoxFloat oy, BoxFloat oz,
                                                     BoxFloat sx, BoxFloat sy, Crossing* c) {
  c->az = vertex[2] - oz;
  c->bz = vertex[5] - oz;
  c->cz = vertex[8] - oz;
  const BoxFloat ax = sheared(vertex[0] - ox, sx, c->az), ay = sheared(vertex[1] - oy, sy, c->az),
                 bx = sheared(vertex[3] - ox, sx, c->bz), by = sheared(vertex[4] - oy, sy, c->bz),
                 cx = sheared(vertex[6] - ox, sx, c->cz), cy = sheared(vertex[7] - oy, sy, c->cz);
  c->u = edge_function(bx, by, cx, cy);
  c->v = edge_function(cx, cy, ax, ay);
  c->w = edge_function(ax, ay, bx, by);
  c->det = c->u + c->v + c->w;
  return ((smaller_of(smaller_of(c->u, c->v), c->w) >= 0.0f) | (larger_of(larger_of(c->u, c->v), c->w) <= 0.0f)) &
         (c->det != 0.0f);
}

/* Distance t, barycentric coordinates b and c, and the inverse of normal . direction, below 0 for a front face. Returns
 * whether the crossing counts. tolerance: of the distance, times twice the area, > 0 towards the ray's origin. */
__attribute__((always_inline)) INLINE BoxInt crossing_distance(const Crossing* x, BoxFloat sz, BoxFloat tolerance,
                                                               BoxFloat limit, BoxFloat* t, BoxFloat* b, BoxFloat* c,
                                                               BoxFloat* inverse) {
  /* depth: (a - origin) . N with N the normal times twice the area; t = depth / (N . direction). */
  const BoxFloat unit = 1.0f / x->det, depth = x->u * x->az + x->v * x->bz + x->w * x->cz;
  *inverse = sz * unit;
  *t = depth * *inverse;
  *b = x->v * unit;
  *c = x->w * unit;
  return ((depth + tolerance) * *inverse > 0.0f) & (*t - larger_of(tolerance * *inverse, 0.0f) < limit);
}

__attribute__((always_inline)) INLINE void meet_triangles(__global const float* block, float side, const Shear* s,
                                                          int skip, Found* found) {
  const int axes[3] = {s->kx, s->ky, s->kz};
  BoxFloat vertex[9];
  UNROLL_FOR(int k = 0; k < 3; ++k) {
    vertex[k] = LOAD_BOX(block + axes[k], BLOCK_A);
    vertex[3 + k] = LOAD_BOX(block + axes[k], BLOCK_B);
    vertex[6 + k] = LOAD_BOX(block + axes[k], BLOCK_C);
  }
  Crossing crossing;
  const BoxInt crossed = crosses(vertex, s->ox, s->oy, s->oz, s->sx, s->sy, &crossing);
  BoxLanes t, b, c, i;
  const BoxInt counts = crossing_distance(&crossing, s->sz, side * LOAD_BOX(block, BLOCK_TOLERANCE), found->limit, &t.v,
                                          &b.v, &c.v, &i.v);
  const uint candidates = box_bits(crossed & counts);
  FOR_EACH_LANE(l, candidates) {
    const int primitive = as_int(block[BLOCK_PRIMITIVE * BOX_WIDTH + l]);
    /* the order in which triangles are met does not matter, not even on their common edge */
    const bool closer = t.f[l] < found->t || (t.f[l] == found->t && primitive < found->primitive);
    if (closer && primitive != skip) {
      found->t = t.f[l];
      found->limit = min(found->limit, t.f[l]);
      found->u = b.f[l];
      found->v = c.f[l];
      found->primitive = primitive;
      found->front = i.f[l] < 0.0f;
      found->round = false;
      found->lane = block + l;
    }
  }
}

/* Distance to a sphere, negative or NaN when it is not met. from: centre to origin.
 * Haines, Guenther, Akenine-Moeller: Precision Improvements for Ray/Sphere Intersection, 2019. */
INLINE float meet_sphere(float3 from, Ray ray, float radius, float tolerance, bool starts_here, int* front,
                         float* slack) {
  const bool inside = ray.inside;
  const float a = dot(ray.direction, ray.direction);
  const float b = -dot(from, ray.direction) / a;
  *front = 0;
  *slack = 0.0f;
  if (starts_here) {
    /* Beside the surface, on the side for which the direction leaves (beside_surface). The medium does not tell the
     * side: glass may have none, and a sphere inside a medium, or turned inside out, has one on its outer side. Where
     * the direction grazes so much that rounding decides its sign, the usual meaning of inside does. */
    const bool inward = fabs(b) < tolerance ? inside : b > 0.0f;
    return inward ? fmax(2.0f * b, tolerance) : -1.0f;
  }
  const float3 nearest = from + b * ray.direction;
  float height = length(from) - radius;
  float s = (radius * radius - dot(nearest, nearest)) / a;
  if (fabs(height) < tolerance) {
    /* Taken to be on the side on which the path is. */
    height = inside ? fmin(height, 0.0f) : fmax(height, 0.0f);
    if (inside) s = fmax(s, b * b);
  }
  s = sqrt(s); /* NaN: passes by */
  *slack = fmin(tolerance * radius / s, s);
  const float product = height * (height + 2.0f * radius) / a; /* of both solutions */
  if (height < 0.0f || (height == 0.0f && inside)) return b > 0.0f ? b + s : fmax(product / (b - s), 0.0f);
  *front = 1;
  return b > 0.0f ? product / (b + s) : -1.0f;
}

/* Distance to a cylinder, negative or NaN when it is not met. from: the middle of its first circle to the ray's origin.
 * In the plane across the axis as in meet_sphere; but the ends are open, so that the far side may be met first.
 * dual: the axis over its squared length. */
INLINE float meet_cylinder(float3 from, Ray ray, float3 dual, float radius, float tolerance, bool starts_here,
                           int* front, float* slack) {
  const float3 axis = normalize(dual);
  const float3 across = from - dot(from, axis) * axis, direction = ray.direction - dot(ray.direction, axis) * axis;
  const float a = dot(direction, direction);
  const float b = -dot(across, direction) / a;
  float near = -1.0f, far;
  *slack = 0.0f;
  if (starts_here) {
    const bool inward = fabs(b) * a < tolerance ? ray.inside : b > 0.0f;
    far = inward ? fmax(2.0f * b, tolerance) : -1.0f;
  } else {
    const float3 nearest = across + b * direction;
    const float s = sqrt((radius * radius - dot(nearest, nearest)) / a); /* NaN: passes by */
    float height = length(across) - radius;
    if (fabs(height) < tolerance) height = ray.inside ? fmin(height, 0.0f) : fmax(height, 0.0f);
    *slack = fmin(tolerance * radius / (a * s), s);
    const float product = height * (height + 2.0f * radius) / a; /* of both solutions */
    if (height < 0.0f || (height == 0.0f && ray.inside)) {
      far = b > 0.0f ? b + s : fmax(product / (b - s), 0.0f);
    } else {
      near = b > 0.0f ? product / (b + s) : -1.0f;
      far = b > 0.0f ? b + s : -1.0f;
    }
  }
  const float start = dot(from, dual), speed = dot(ray.direction, dual); /* along the axis, in its lengths */
  *front = near >= 0.0f && start + near * speed >= 0.0f && start + near * speed <= 1.0f;
  if (*front) return near;
  return start + far * speed >= 0.0f && start + far * speed <= 1.0f ? far : -1.0f;
}

__attribute__((noinline)) void meet_round(__global const float* block, Ray ray, int skip, Found* found) {
  for (int l = 0; l < BOX_WIDTH; ++l) {
    __global const float* p = block + l;
    const int primitive = as_int(p[BLOCK_PRIMITIVE * BOX_WIDTH]);
    if (primitive < 0) return;
    const float3 center =
        (float3)(p[BLOCK_CENTER * BOX_WIDTH], p[(BLOCK_CENTER + 1) * BOX_WIDTH], p[(BLOCK_CENTER + 2) * BOX_WIDTH]);
    const float radius = p[BLOCK_RADIUS * BOX_WIDTH], tolerance = p[BLOCK_TOLERANCE * BOX_WIDTH];
    float t, slack;
    int front;
    if (radius > 0) {
      t = meet_sphere(ray.origin - center, ray, radius, tolerance, primitive == skip, &front, &slack);
      if (!(t >= 0.0f)) continue;
    } else if (radius < 0) {
      const float3 dual = (float3)(p[BLOCK_DUAL_AXIS * BOX_WIDTH], p[(BLOCK_DUAL_AXIS + 1) * BOX_WIDTH],
                                   p[(BLOCK_DUAL_AXIS + 2) * BOX_WIDTH]);
      t = meet_cylinder(ray.origin - center, ray, dual, -radius, tolerance, primitive == skip, &front, &slack);
      if (!(t >= 0.0f)) continue;
    } else {
      if (primitive == skip) continue;
      const float3 u =
          (float3)(p[BLOCK_DUAL_U * BOX_WIDTH], p[(BLOCK_DUAL_U + 1) * BOX_WIDTH], p[(BLOCK_DUAL_U + 2) * BOX_WIDTH]);
      const float3 v =
          (float3)(p[BLOCK_DUAL_V * BOX_WIDTH], p[(BLOCK_DUAL_V + 1) * BOX_WIDTH], p[(BLOCK_DUAL_V + 2) * BOX_WIDTH]);
      const float3 normal = normalize(cross(u, v));
      const float speed = dot(normal, ray.direction), depth = dot(center - ray.origin, normal);
      t = depth / speed;
      front = speed < 0.0f;
      slack = fmax(ray.side * tolerance / speed, 0.0f);
      const float3 q = ray.origin + t * ray.direction - center;
      const float a = dot(u, q), b = dot(v, q);
      if (!((depth + ray.side * tolerance) / speed > 0.0f && a * a + b * b <= 1.0f)) continue;
    }
    if (!(t < found->t && t - slack < found->limit)) continue;
    found->t = t;
    found->limit = fmin(found->limit, t);
    found->primitive = primitive;
    found->front = front;
    found->round = true;
    found->lane = p;
  }
}

INLINE float3 vertex_of(__global const float* lane, int row) {
  return (float3)(lane[row * BOX_WIDTH], lane[(row + 1) * BOX_WIDTH], lane[(row + 2) * BOX_WIDTH]);
}

/* The point of a triangle with barycentric coordinates u, v: of its second and third vertex. lane: of its block. A few
 * roundings away from its edges. */
INLINE REAL3 position_on_triangle(__global const float* lane, REAL u, REAL v) {
  const float margin = lane[BLOCK_MARGIN * BOX_WIDTH];
  const float3 a = vertex_of(lane, BLOCK_A), ab = vertex_of(lane, BLOCK_B) - a, ac = vertex_of(lane, BLOCK_C) - a;
  u = MIN(MAX(u, (REAL)(margin)), (REAL)(1.0f - 2.0f * margin));
  v = MIN(MAX(v, (REAL)(margin)), 1.0f - margin - u);
  return make3(a.x + u * ab.x + v * ac.x, a.y + u * ab.y + v * ac.y, a.z + u * ab.z + v * ac.z);
}

/* From the centre of a sphere, or the axis of a cylinder, to a position. */
INLINE float3 out_of_curved(__global const PrimitiveRecord* primitive, float3 position) {
  const float3 from = position - (float3)(primitive->normal[0], primitive->normal[1], primitive->normal[2]);
  if (primitive->flags & PRIMITIVE_SPHERE) return from;
  const float3 dual = (float3)(primitive->frame[6], primitive->frame[7], primitive->frame[8]);
  return from - dot(from, dual) / dot(dual, dual) * dual;
}

/* The point where the ray meets a round primitive, computed on the primitive. */
INLINE float3 position_on_round(__global const PrimitiveRecord* primitive, Ray ray, Found* found) {
  const float3 along = ray.origin + found->t * ray.direction;
  const float3 n = (float3)(primitive->normal[0], primitive->normal[1], primitive->normal[2]);
  if (primitive->flags & PRIMITIVE_SPHERE) return n + primitive->radius * normalize(along - n);
  if (primitive->flags & PRIMITIVE_CYLINDER) {
    const float3 out = out_of_curved(primitive, along);
    return along - out + primitive->radius * normalize(out);
  }
  return along - dot(along - vertex_of(found->lane, BLOCK_CENTER), n) * n;
}

/* The data of the walks of WIDTH rays that depend on the rays and the bounds of the geometry alone. */
typedef struct {
  /* Origin; of rays from outside where they meet the bounds: the tests' rounding errors grow with its coordinates. */
  Lanes ox, oy, oz;
  Lanes dx, dy, dz;                /* direction */
  Lanes start;                     /* distance from the ray's origin to this one */
  Lanes ix, iy, iz;                /* inverse of the direction */
  Lanes shift_x, shift_y, shift_z; /* -origin times inverse */
  Lanes kx, ky, kz;                /* as in Shear, the axes as offsets in a block */
  Lanes across_x, across_y, across_z, slope_x, slope_y, slope_z;
} RaySetup;

INLINE REAL clamped_inverse(REAL d) { return 1.0f / SELECT(ABS(d) > 1e-20f, d, copysign((REAL)(1e-20f), d)); }

INLINE REAL component(REAL3 v, INT axis) { return SELECT(axis == 0, v.x, SELECT(axis == 1, v.y, v.z)); }

/* Returns which rays meet the bounds at all. */
INLINE MASK set_up_rays(__global const GeometryRecord* record, REAL3 origin, REAL3 direction, RaySetup* s) {
  const REAL3 inverse = make3(clamped_inverse(direction.x), clamped_inverse(direction.y), clamped_inverse(direction.z));
  const REAL x0 = (record->low[0] - origin.x) * inverse.x, x1 = (record->high[0] - origin.x) * inverse.x;
  const REAL y0 = (record->low[1] - origin.y) * inverse.y, y1 = (record->high[1] - origin.y) * inverse.y;
  const REAL z0 = (record->low[2] - origin.z) * inverse.z, z1 = (record->high[2] - origin.z) * inverse.z;
  const REAL enter = MAX(MAX(MAX(MIN(x0, x1), MIN(y0, y1)), MIN(z0, z1)), (REAL)(0.0f)),
             leave = MIN(MIN(MAX(x0, x1), MAX(y0, y1)), MAX(z0, z1));
  const MASK outside = (origin.x < record->low[0]) | (origin.y < record->low[1]) | (origin.z < record->low[2]) |
                       (origin.x > record->high[0]) | (origin.y > record->high[1]) | (origin.z > record->high[2]);
  const REAL start = SELECT(outside, enter, 0.0f);
  origin = select3(outside, add3(origin, scale3(direction, start)), origin);

  s->start.real = start;
  s->ox.real = origin.x;
  s->oy.real = origin.y;
  s->oz.real = origin.z;
  s->dx.real = direction.x;
  s->dy.real = direction.y;
  s->dz.real = direction.z;
  s->ix.real = inverse.x;
  s->iy.real = inverse.y;
  s->iz.real = inverse.z;
  s->shift_x.real = -origin.x * inverse.x;
  s->shift_y.real = -origin.y * inverse.y;
  s->shift_z.real = -origin.z * inverse.z;
  const REAL x = ABS(direction.x), y = ABS(direction.y), z = ABS(direction.z);
  const INT kz = SELECT_INT(x > y, SELECT_INT(x > z, 0, 2), SELECT_INT(y > z, 1, 2));
  const INT kx = SELECT_INT(kz == 2, 0, kz + 1), ky = SELECT_INT(kx == 2, 0, kx + 1);
  s->kx.integer = kx * BOX_WIDTH;
  s->ky.integer = ky * BOX_WIDTH;
  s->kz.integer = kz * BOX_WIDTH;
  s->across_x.real = component(origin, kx);
  s->across_y.real = component(origin, ky);
  s->across_z.real = component(origin, kz);
  const REAL slope_z = 1.0f / component(direction, kz);
  s->slope_z.real = slope_z;
  s->slope_x.real = component(direction, kx) * slope_z;
  s->slope_y.real = component(direction, ky) * slope_z;
  /* A ray that is not finite meets nothing: to comparisons with NaN even the empty boxes of a node are in the way, and
   * their children lead anywhere. */
  const MASK finite = x + y + z + (ABS(origin.x) + ABS(origin.y) + ABS(origin.z)) < INFINITY;
  return finite & (!outside | (enter <= 1.000001f * leave));
}

/* One lane of RaySetup against the boxes of a node: rows of the planes that the ray enters and leaves through. */
typedef struct {
  float ix, iy, iz, shift_x, shift_y, shift_z; /* as in RaySetup */
  int near_x, near_y, near_z, far_x, far_y, far_z;
} Slabs;

__attribute__((always_inline)) INLINE Slabs slabs_of_lane(const RaySetup* setup, int l) {
  Slabs s;
  s.ix = setup->ix.f[l];
  s.iy = setup->iy.f[l];
  s.iz = setup->iz.f[l];
  s.shift_x = setup->shift_x.f[l];
  s.shift_y = setup->shift_y.f[l];
  s.shift_z = setup->shift_z.f[l];
  s.near_x = NODE_LOW_X + (setup->ix.i[l] < 0);
  s.near_y = NODE_LOW_Y + (setup->iy.i[l] < 0);
  s.near_z = NODE_LOW_Z + (setup->iz.i[l] < 0);
  s.far_x = NODE_LOW_X + NODE_HIGH_X - s.near_x;
  s.far_y = NODE_LOW_Y + NODE_HIGH_Y - s.near_y;
  s.far_z = NODE_LOW_Z + NODE_HIGH_Z - s.near_z;
  return s;
}

/* Bits of the children of a node whose boxes the ray meets before `limit`, and where it enters each. */
__attribute__((always_inline)) INLINE uint meet_boxes(__global const float* node, const Slabs* s, float limit,
                                                      BoxLanes* enter_t) {
  enter_t->v = larger_of(
      larger_of(LOAD_BOX(node, s->near_x) * s->ix + s->shift_x, LOAD_BOX(node, s->near_y) * s->iy + s->shift_y),
      larger_of(LOAD_BOX(node, s->near_z) * s->iz + s->shift_z, 0.0f));
  const BoxFloat leave_t = smaller_of(
      smaller_of(LOAD_BOX(node, s->far_x) * s->ix + s->shift_x, LOAD_BOX(node, s->far_y) * s->iy + s->shift_y),
      smaller_of(LOAD_BOX(node, s->far_z) * s->iz + s->shift_z, limit));
  return box_bits(enter_t->v <= leave_t);
}

/* Bits of a distance that is not negative sort as the distance does. */
INLINE ulong stack_entry(float distance, int child) { return (ulong)as_uint(distance) << 32 | (uint)child; }

/* The nearest of the children in `bits`, of which there are some; the others go to the stack. */
__attribute__((always_inline)) INLINE int keep_children(__global const float* node, uint bits, const BoxLanes* enter_t,
                                                        ulong stack[], int* size) {
  __global const int* child = (__global const int*)(node + NODE_CHILD * BOX_WIDTH);
  const int first = LOWEST_BIT(bits);
  bits &= bits - 1;
  if (!bits) return child[first];
  ulong nearest = stack_entry(enter_t->f[first], child[first]);
  FOR_EACH_LANE(l, bits) {
    const ulong entry = stack_entry(enter_t->f[l], child[l]);
    stack[(*size)++] = max(entry, nearest);
    nearest = min(entry, nearest);
  }
  return (int)(uint)nearest;
}

/* The hit that a walk from `setup`'s origin has found. */
__attribute__((always_inline)) INLINE Hit hit_of(Surfaces surfaces, const RaySetup* setup, int l, Ray ray,
                                                 Found* found) {
  Hit hit;
  hit.primitive = -1;
  if (found->primitive < 0) return hit;
  hit.primitive = found->primitive + (int)surfaces.record->first_primitive;
  hit.t = max(found->t, 0.0f) + setup->start.f[l];
  hit.front = found->front;
  hit.u = found->u;
  hit.v = found->v;
  if (found->round) {
    const float3 position = position_on_round(surfaces.primitives + hit.primitive, ray, found);
    hit.x = position.x;
    hit.y = position.y;
    hit.z = position.z;
  } else {
    const REAL3 position = position_on_triangle(found->lane, (REAL)(found->u), (REAL)(found->v));
    Lanes x, y, z;
    x.real = position.x;
    y.real = position.y;
    z.real = position.z;
    hit.x = x.f[0];
    hit.y = y.f[0];
    hit.z = z.f[0];
  }
  return hit;
}

/* Lane l's closest hit with a distance below t_max, or so little beyond that the position at t_max could be rounded to
 * the other side: what flies t_max without a hit surely stays on its side. skip: the primitive on which the ray starts,
 * or -1: a flat one is not met again, of a sphere or cylinder only the far side is. inside: the path is inside (leaves
 * through the next surface) or outside. onward: nothing behind the origin counts, however little. */
INLINE Hit trace_lane(Surfaces surfaces, const RaySetup* setup, int l, float t_max, int skip, bool inside,
                      bool onward) {
  __global const GeometryRecord* record = surfaces.record;
  Hit none;
  none.primitive = -1;
  if (record->root == CHILD_NONE) return none;
  Ray ray;
  ray.origin = (float3)(setup->ox.f[l], setup->oy.f[l], setup->oz.f[l]);
  ray.direction = (float3)(setup->dx.f[l], setup->dy.f[l], setup->dz.f[l]);
  ray.side = onward ? 0.0f : inside ? 1.0f : -1.0f;
  ray.inside = inside;
  if (skip >= 0) skip -= (int)record->first_primitive;
  const Slabs slabs = slabs_of_lane(setup, l);
  const Shear shear = {setup->kx.i[l],       setup->ky.i[l],       setup->kz.i[l],
                       setup->across_x.f[l], setup->across_y.f[l], setup->across_z.f[l],
                       setup->slope_x.f[l],  setup->slope_y.f[l],  setup->slope_z.f[l]};
  Found found;
  found.limit = t_max - setup->start.f[l];
  found.t = INFINITY;
  found.primitive = -1;
  found.u = found.v = 0.0f; /* round ones have none */
  ulong stack[TRACE_STACK(BOX_WIDTH)];
  int size = 0;
  int current = record->root;
  for (;;) {
    if (CHILD_IS_NODE(current)) {
      __global const float* node = surfaces.nodes + (size_t)current * (NODE_ROWS * BOX_WIDTH);
      BoxLanes enter_t;
      const uint bits = meet_boxes(node, &slabs, found.limit, &enter_t);
      if (bits) {
        current = keep_children(node, bits, &enter_t, stack, &size);
        continue;
      }
    } else {
      __global const float* block = surfaces.leaves + (size_t)CHILD_BLOCK_INDEX(current) * (BLOCK_ROWS * BOX_WIDTH);
      if (CHILD_IS_ROUND(current))
        meet_round(block, ray, skip, &found);
      else
        meet_triangles(block, ray.side, &shear, skip, &found);
    }
    do {
      if (size == 0) return hit_of(surfaces, setup, l, ray, &found);
      current = (int)(uint)stack[--size];
    } while (as_float((uint)(stack[size] >> 32)) >= found.limit);
  }
}

/* The closest hits of the rays of all lanes. */
typedef struct {
  Lanes distance, primitive, u, v, x, y, z; /* as in Hit */
} LaneHits;

/* Traces the lanes in `mask`; others get primitive -1. inside, onward: as in trace_lane. */
INLINE LaneHits trace_lanes(Surfaces surfaces, REAL3 origin, REAL3 direction, REAL t_max, INT skip, MASK inside,
                            MASK onward, MASK mask) {
  LaneHits hits;
  RaySetup setup;
  const MASK meets_bounds = set_up_rays(surfaces.record, origin, direction, &setup);
  Lanes from, in, ahead;
  hits.x.real = origin.x;
  hits.y.real = origin.y;
  hits.z.real = origin.z;
  from.integer = skip;
  in.integer = inside;
  ahead.integer = onward;
  hits.distance.real = t_max;
  hits.primitive.integer = (INT)(-1);
  hits.u.real = (REAL)(0.0f);
  hits.v.real = (REAL)(0.0f);
  uint bits = lane_bits(mask & meets_bounds);
  FOR_EACH_LANE(l, bits) {
    const Hit hit = trace_lane(surfaces, &setup, l, hits.distance.f[l], from.i[l], in.i[l] != 0, ahead.i[l] != 0);
    if (hit.primitive < 0) continue;
    hits.primitive.i[l] = hit.primitive;
    hits.distance.f[l] = hit.t;
    hits.u.f[l] = hit.u;
    hits.v.f[l] = hit.v;
    hits.x.f[l] = hit.x;
    hits.y.f[l] = hit.y;
    hits.z.f[l] = hit.z;
  }
  return hits;
}

/* A single ray. */
INLINE Hit trace(Surfaces surfaces, float3 origin, float3 direction, float t_max, int skip, bool inside) {
  RaySetup setup;
  const REAL3 o = make3((REAL)(origin.x), (REAL)(origin.y), (REAL)(origin.z)),
              d = make3((REAL)(direction.x), (REAL)(direction.y), (REAL)(direction.z));
  if (ANY(set_up_rays(surfaces.record, o, d, &setup)))
    return trace_lane(surfaces, &setup, 0, t_max, skip, inside, false);
  Hit none;
  none.primitive = -1;
  return none;
}

#endif
