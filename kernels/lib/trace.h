/* The closest surface along a ray.
 *
 * Nothing leaks. The edge tests of a triangle (Woop, Benthin, Wald: Watertight Ray/Triangle Intersection, 2013) look at
 * vertices in coordinates that depend on ray and vertex alone, so two triangles see a shared edge with exactly opposite
 * numbers, and as products are rounded one by one, the sign is right or the value 0, which counts as a hit. Boxes are
 * wider than the rounding errors of their test. What remains is where a ray starts: a position lies only nearly on its
 * surface, or nearly in front of the next one. Four measures:
 *   - a returned position is computed on its primitive and kept a few roundings away from a triangle's edges;
 *   - a path goes on from a surface an `offset` beside it, on the side to which it goes (beside_surface() in
 *     lib/surface_frame.h);
 *   - what comes so close to a surface that rounding could put it on the other side counts as meeting it;
 *   - `inside` tells which side of a surface a consistent path meets next: all surfaces count as moved by their
 *     tolerance so that the path is on the right side of them. */
#ifndef ITN_TRACE_H
#define ITN_TRACE_H
#include "lib/box_vector.h"
#include "shared/geometry_layout.h"

typedef struct {
  __global const float* nodes;
  __global const float* leaves;
  __global const PrimitiveRecord* primitives;
  __global const GeometryRecord* record;
} Surfaces;

typedef struct {
  float t;    /* distance [units of the direction] */
  float u, v; /* barycentric coordinates of a triangle's second and third vertex */
  float x, y, z; /* position on the surface, more exact than origin + t * direction: go on beside_surface() */
  int primitive; /* index into Surfaces.primitives, -1: no hit; the other members are then undefined */
  int front;     /* 1: the ray enters, against the outward normal, 0: it leaves */
} Hit;

typedef struct {
  float3 origin, direction;
  float side;  /* +1: inside, -1: outside; 0: nothing behind the origin counts */
  bool inside; /* the path expects to leave */
} Ray;

inline Surfaces surfaces_of(__global const float* nodes, __global const float* leaves,
                            __global const PrimitiveRecord* primitives, __global const GeometryRecord* record) {
  Surfaces s;
  s.nodes = nodes + record->first_node;
  s.leaves = leaves + record->first_leaf;
  s.primitives = primitives;
  s.record = record;
  return s;
}

inline float clamped_inverse(float d) { return 1.0f / (fabs(d) > 1e-20f ? d : copysign(1e-20f, d)); }

/* A vertex coordinate across the ray. */
inline BoxFloat sheared(BoxFloat coordinate, float slope, BoxFloat depth) { return coordinate - slope * depth; }

/* Twice the signed area of (origin, a, b). Antisymmetric, and never of the wrong sign: must not become a fused
 * operation. */
inline BoxFloat edge_function(BoxFloat ax, BoxFloat ay, BoxFloat bx, BoxFloat by) {
#pragma OPENCL FP_CONTRACT OFF
  const BoxFloat p = ax * by;
  const BoxFloat q = bx * ay;
  return p - q;
}

/* The ray seen along its longest axis kz. */
typedef struct {
  int kx, ky, kz;
  float ox, oy, oz;
  float sx, sy, sz; /* slopes of the direction over kz, and the inverse of its component along kz */
} Shear;

inline float component(float3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

inline Shear shear_of(float3 o, float3 d) {
  Shear s;
  const float x = fabs(d.x), y = fabs(d.y), z = fabs(d.z);
  s.kz = x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
  s.kx = s.kz == 2 ? 0 : s.kz + 1;
  s.ky = s.kx == 2 ? 0 : s.kx + 1;
  s.ox = component(o, s.kx);
  s.oy = component(o, s.ky);
  s.oz = component(o, s.kz);
  s.sz = 1.0f / component(d, s.kz);
  s.sx = component(d, s.kx) * s.sz;
  s.sy = component(d, s.ky) * s.sz;
  return s;
}

/* The found hit while the walk goes on. */
typedef struct {
  float limit; /* of the walk: t_max or the hit */
  float t, u, v;
  int primitive, front;
  __global const float* lane; /* of the block */
} Found;

__attribute__((always_inline)) inline void meet_triangles(__global const float* block, float side, const Shear* s,
                                                          int skip, Found* found) {
  __global const float *px = block + s->kx * BOX_WIDTH, *py = block + s->ky * BOX_WIDTH,
                       *pz = block + s->kz * BOX_WIDTH;
  const BoxFloat az = LOAD_BOX(pz, BLOCK_A) - s->oz, bz = LOAD_BOX(pz, BLOCK_B) - s->oz,
                 cz = LOAD_BOX(pz, BLOCK_C) - s->oz;
  const BoxFloat ax = sheared(LOAD_BOX(px, BLOCK_A) - s->ox, s->sx, az),
                 ay = sheared(LOAD_BOX(py, BLOCK_A) - s->oy, s->sy, az),
                 bx = sheared(LOAD_BOX(px, BLOCK_B) - s->ox, s->sx, bz),
                 by = sheared(LOAD_BOX(py, BLOCK_B) - s->oy, s->sy, bz),
                 cx = sheared(LOAD_BOX(px, BLOCK_C) - s->ox, s->sx, cz),
                 cy = sheared(LOAD_BOX(py, BLOCK_C) - s->oy, s->sy, cz);
  const BoxFloat u = edge_function(bx, by, cx, cy), v = edge_function(cx, cy, ax, ay),
                 w = edge_function(ax, ay, bx, by);
  const BoxFloat det = u + v + w;
  const BoxInt covers =
      ((smaller_of(smaller_of(u, v), w) >= 0.0f) | (larger_of(larger_of(u, v), w) <= 0.0f)) & (det != 0.0f);
  if (!box_bits(covers)) return;
  /* depth: (a - origin) . N with N the normal times twice the area; t = depth / (N . direction). */
  const BoxFloat unit = 1.0f / det, inverse = s->sz * unit;
  const BoxFloat depth = u * az + v * bz + w * cz, tolerance = side * LOAD_BOX(block, BLOCK_TOLERANCE);
  BoxLanes t;
  t.v = depth * inverse;
  uint candidates = box_bits(covers & ((depth + tolerance) * inverse > 0.0f) &
                             (t.v - larger_of(tolerance * inverse, 0.0f) < found->limit));
  if (!candidates) return;
  BoxLanes b, c, i;
  b.v = v * unit;
  c.v = w * unit;
  i.v = inverse;
  FOR_EACH_LANE(l, candidates) {
    const int primitive = as_int(block[BLOCK_PRIMITIVE * BOX_WIDTH + l]);
    if (t.f[l] < found->t && primitive != skip) {
      found->t = t.f[l];
      found->limit = min(found->limit, t.f[l]);
      found->u = b.f[l];
      found->v = c.f[l];
      found->primitive = primitive;
      found->front = i.f[l] < 0.0f;
      found->lane = block + l;
    }
  }
}

/* Distance to a sphere, negative or NaN when it is not met. from: centre to origin.
 * Haines, Guenther, Akenine-Moeller: Precision Improvements for Ray/Sphere Intersection, 2019. */
inline float meet_sphere(float3 from, Ray ray, float radius, float tolerance, bool starts_here, int* front,
                         float* slack) {
  const bool inside = ray.inside;
  const float a = dot(ray.direction, ray.direction);
  const float b = -dot(from, ray.direction) / a;
  *front = 0;
  *slack = 0.0f;
  if (starts_here) {
    /* Beside the surface, on the side for which the direction leaves (beside_surface). The medium does not tell the side:
     * glass may have none, and a sphere inside a medium, or turned inside out, has one on its outer side. Where the
     * direction grazes so much that rounding decides its sign, the usual meaning of inside does. */
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
    found->lane = p;
  }
}

inline float3 vertex_of(__global const float* lane, int row) {
  return (float3)(lane[row * BOX_WIDTH], lane[(row + 1) * BOX_WIDTH], lane[(row + 2) * BOX_WIDTH]);
}

/* Where the ray meets the surface, computed on the surface. */
inline float3 position_on(__global const PrimitiveRecord* primitive, Ray ray, Found* found) {
  const float3 along = ray.origin + found->t * ray.direction;
  const float3 n = (float3)(primitive->normal[0], primitive->normal[1], primitive->normal[2]);
  if (primitive->flags & PRIMITIVE_SPHERE) return n + primitive->radius * normalize(along - n);
  if (primitive->flags & PRIMITIVE_DISK) return along - dot(along - vertex_of(found->lane, BLOCK_CENTER), n) * n;
  const float margin = found->lane[BLOCK_MARGIN * BOX_WIDTH];
  const float3 a = vertex_of(found->lane, BLOCK_A), b = vertex_of(found->lane, BLOCK_B),
               c = vertex_of(found->lane, BLOCK_C);
  const float u = clamp(found->u, margin, 1.0f - 2.0f * margin);
  const float v = clamp(found->v, margin, 1.0f - margin - u);
  return a + u * (b - a) + v * (c - a);
}

/* Closest hit with a distance below t_max, or so little beyond that the position at t_max could be rounded to the other
 * side: what flies t_max without a hit surely stays on its side. skip: the primitive on which the ray starts, or -1: a
 * flat one is not met again, of a sphere only the far side is. inside: the path is inside (leaves through the next
 * surface) or outside. */
inline Hit trace_onward(Surfaces surfaces, float ox, float oy, float oz, float dx, float dy, float dz, float t_max, int skip,
                 bool inside, bool strict) {
  __global const GeometryRecord* record = surfaces.record;
  Ray ray;
  ray.origin = (float3)(ox, oy, oz);
  ray.direction = (float3)(dx, dy, dz);
  ray.side = strict ? 0.0f : inside ? 1.0f : -1.0f;
  ray.inside = inside;
  if (skip >= 0) skip -= (int)record->first_primitive;
  Hit hit;
  hit.primitive = -1;

  const float3 inverse = (float3)(clamped_inverse(dx), clamped_inverse(dy), clamped_inverse(dz));
  /* Rays from outside start where they meet the bounds: the tests' rounding errors grow with the origin's coordinates.
   */
  float start = 0.0f;
  if (ox < record->low[0] || oy < record->low[1] || oz < record->low[2] || ox > record->high[0] ||
      oy > record->high[1] || oz > record->high[2]) {
    const float3 low = ((float3)(record->low[0], record->low[1], record->low[2]) - ray.origin) * inverse,
                 high = ((float3)(record->high[0], record->high[1], record->high[2]) - ray.origin) * inverse;
    const float3 enter = fmin(low, high), leave = fmax(low, high);
    start = fmax(fmax(fmax(enter.x, enter.y), enter.z), 0.0f);
    if (!(start <= 1.000001f * fmin(fmin(leave.x, leave.y), leave.z))) return hit;
    ray.origin += start * ray.direction;
  }
  if (record->root == CHILD_NONE) return hit;

  const float3 shift = -ray.origin * inverse;
  const Shear shear = shear_of(ray.origin, ray.direction);
  const int near_x = inverse.x < 0 ? NODE_HIGH_X : NODE_LOW_X, near_y = inverse.y < 0 ? NODE_HIGH_Y : NODE_LOW_Y,
            near_z = inverse.z < 0 ? NODE_HIGH_Z : NODE_LOW_Z;
  const int far_x = NODE_LOW_X + NODE_HIGH_X - near_x, far_y = NODE_LOW_Y + NODE_HIGH_Y - near_y,
            far_z = NODE_LOW_Z + NODE_HIGH_Z - near_z;
  Found found;
  found.limit = t_max - start;
  found.t = INFINITY;
  found.primitive = -1;
  found.u = found.v = 0.0f; /* spheres and disks have none */
  int stack[TRACE_STACK(BOX_WIDTH)];
  float stack_t[TRACE_STACK(BOX_WIDTH)];
  int size = 0;
  int current = record->root;
  for (;;) {
    if (CHILD_IS_NODE(current)) {
      __global const float* node = surfaces.nodes + (size_t)current * (NODE_ROWS * BOX_WIDTH);
      BoxLanes enter_t;
      enter_t.v = larger_of(
          larger_of(LOAD_BOX(node, near_x) * inverse.x + shift.x, LOAD_BOX(node, near_y) * inverse.y + shift.y),
          larger_of(LOAD_BOX(node, near_z) * inverse.z + shift.z, 0.0f));
      const BoxFloat leave_t = smaller_of(
          smaller_of(LOAD_BOX(node, far_x) * inverse.x + shift.x, LOAD_BOX(node, far_y) * inverse.y + shift.y),
          smaller_of(LOAD_BOX(node, far_z) * inverse.z + shift.z, found.limit));
      uint bits = box_bits(enter_t.v <= leave_t);
      if (bits) {
        __global const int* child = (__global const int*)(node + NODE_CHILD * BOX_WIDTH);
        const int first = LOWEST_BIT(bits);
        bits &= bits - 1;
        current = child[first];
        if (bits) {
          /* Goes on with the nearest child, keeps the others. */
          float nearest = enter_t.f[first];
          FOR_EACH_LANE(l, bits) {
            const float t = enter_t.f[l];
            const int code = child[l];
            const bool closer = t < nearest;
            stack[size] = closer ? current : code;
            stack_t[size++] = closer ? nearest : t;
            current = closer ? code : current;
            nearest = closer ? t : nearest;
          }
        }
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
      if (size == 0) {
        if (found.primitive >= 0) {
          hit.primitive = found.primitive + (int)record->first_primitive;
          const float3 position = position_on(surfaces.primitives + hit.primitive, ray, &found);
          hit.t = fmax(found.t, 0.0f) + start;
          hit.front = found.front;
          hit.u = found.u;
          hit.v = found.v;
          hit.x = position.x;
          hit.y = position.y;
          hit.z = position.z;
        }
        return hit;
      }
      current = stack[--size];
    } while (stack_t[size] >= found.limit);
  }
}

inline Hit trace(Surfaces surfaces, float ox, float oy, float oz, float dx, float dy, float dz, float t_max, int skip,
                 bool inside) {
  return trace_onward(surfaces, ox, oy, oz, dx, dy, dz, t_max, skip, inside, false);
}

#endif
