/* The closest surfaces along rays that start together and stay together, such as those of one pixel: the hierarchy is
 * walked once for all of them, and each triangle that the bundle may meet is tested against all of them at once. The
 * same hits, bit for bit, as trace_lanes finds, whose tests of the single ray decide here too; boxes and triangles are
 * only left out where a bound over the bundle says that no ray can meet them. */
#ifndef ITN_TRACE_COHERENT_H
#define ITN_TRACE_COHERENT_H
#include "geometry/trace.h"

#if WIDTH == BOX_WIDTH && !HAS_ROUND
/* Over all lanes. */
INLINE float least_lane(REAL v) {
#if WIDTH == 16
  const float8 eight = v.lo < v.hi ? v.lo : v.hi;
  const float4 four = eight.lo < eight.hi ? eight.lo : eight.hi;
#elif WIDTH == 8
  const float4 four = v.lo < v.hi ? v.lo : v.hi;
#else
  const float4 four = v;
#endif
  const float2 two = four.lo < four.hi ? four.lo : four.hi;
  return two.x < two.y ? two.x : two.y;
}

/* A value between bounds that hold for every ray of a bundle. */
typedef struct {
  float low, high;
} Range;

INLINE Range range_of(REAL v) {
  Range r = {least_lane(v), -least_lane(-v)};
  return r;
}

/* May triangles of this block be met? Bounds on their vertices' coordinates across the rays, as in Crossing. */
INLINE uint met_by_bundle(__global const float* block, const int axes[3], const float origin[3], Range slope_x,
                          Range slope_y, float margin) {
  BoxFloat low_x = INFINITY, high_x = -INFINITY, low_y = INFINITY, high_y = -INFINITY;
  UNROLL_FOR(int vertex = 0; vertex < 3; ++vertex) {
    const BoxFloat x = LOAD_BOX(block + axes[0], 3 * vertex) - origin[0],
                   y = LOAD_BOX(block + axes[1], 3 * vertex) - origin[1],
                   z = LOAD_BOX(block + axes[2], 3 * vertex) - origin[2];
    const BoxFloat xa = z * slope_x.low, xb = z * slope_x.high, ya = z * slope_y.low, yb = z * slope_y.high;
    low_x = smaller_of(low_x, x - larger_of(xa, xb));
    high_x = larger_of(high_x, x - smaller_of(xa, xb));
    low_y = smaller_of(low_y, y - larger_of(ya, yb));
    high_y = larger_of(high_y, y - smaller_of(ya, yb));
  }
  return box_bits((low_x <= margin) & (high_x >= -margin) & (low_y <= margin) & (high_y >= -margin));
}

/* Rays that are walked together, and bounds that hold for all of them. */
typedef struct {
  MASK mask;          /* others repeat the first */
  float from[3];      /* origin of the first */
  float seen_from[3]; /* the same in the order of `axes` */
  int axes[3];        /* offsets in a block, as in Shear */
  float margin;       /* of coordinates: roundings of the single rays' tests, and how far they start beside the first */
  Range ix, iy, iz, slope_x, slope_y;
  int near_x, near_y, near_z, far_x, far_y, far_z; /* rows of a node, as in Slabs */
  float wide_x, wide_y, wide_z;                    /* margin, away from the planes that the rays enter through */
} Bundle;

/* False: they go too different ways. bits: of mask, at least one. */
__attribute__((always_inline)) INLINE bool bundle_rays(__global const GeometryRecord* record, const RaySetup* setup,
                                                       REAL3 origin, MASK mask, uint bits, Bundle* b) {
  const int first = LOWEST_BIT(bits);
  Lanes x, y, z;
  x.real = origin.x;
  y.real = origin.y;
  z.real = origin.z;
  b->mask = mask;
  b->axes[0] = setup->kx.i[first];
  b->axes[1] = setup->ky.i[first];
  b->axes[2] = setup->kz.i[first];
  const float sign_x = setup->ix.f[first], sign_y = setup->iy.f[first], sign_z = setup->iz.f[first];
  const MASK together = (setup->kz.integer == b->axes[2]) & (setup->ix.real * sign_x > 0.0f) &
                        (setup->iy.real * sign_y > 0.0f) & (setup->iz.real * sign_z > 0.0f);
  if (ANY(mask & !together)) return false;

  b->from[0] = x.f[first];
  b->from[1] = y.f[first];
  b->from[2] = z.f[first];
  UNROLL_FOR(int k = 0; k < 3; ++k) b->seen_from[k] = b->from[b->axes[k] / BOX_WIDTH];
  b->ix = range_of(SELECT(mask, setup->ix.real, sign_x));
  b->iy = range_of(SELECT(mask, setup->iy.real, sign_y));
  b->iz = range_of(SELECT(mask, setup->iz.real, sign_z));
  b->slope_x = range_of(SELECT(mask, setup->slope_x.real, setup->slope_x.f[first]));
  b->slope_y = range_of(SELECT(mask, setup->slope_y.real, setup->slope_y.f[first]));
  float extent = 0.0f;
  UNROLL_FOR(int k = 0; k < 3; ++k) {
    const float low = fabs(record->low[k] - b->from[k]), high = fabs(record->high[k] - b->from[k]);
    extent += max(low, high) + fabs(b->from[k]);
  }
  const REAL beside = MAX(MAX(ABS(origin.x - b->from[0]), ABS(origin.y - b->from[1])), ABS(origin.z - b->from[2]));
  b->margin = 1e-6f * extent - 2.0f * least_lane(SELECT(mask, -beside, 0.0f));
  b->near_x = NODE_LOW_X + (sign_x < 0);
  b->near_y = NODE_LOW_Y + (sign_y < 0);
  b->near_z = NODE_LOW_Z + (sign_z < 0);
  b->far_x = NODE_LOW_X + NODE_HIGH_X - b->near_x;
  b->far_y = NODE_LOW_Y + NODE_HIGH_Y - b->near_y;
  b->far_z = NODE_LOW_Z + NODE_HIGH_Z - b->near_z;
  b->wide_x = copysign(b->margin, sign_x);
  b->wide_y = copysign(b->margin, sign_y);
  b->wide_z = copysign(b->margin, sign_z);
  return true;
}

/* As meet_boxes: children that no ray of the bundle meets before `limit` are left out. */
__attribute__((always_inline)) INLINE uint boxes_of_bundle(__global const float* node, const Bundle* b, float limit,
                                                           BoxLanes* enter_t) {
  const float* from = b->from;
  const BoxFloat nx = LOAD_BOX(node, b->near_x) - (from[0] + b->wide_x),
                 fx = LOAD_BOX(node, b->far_x) - (from[0] - b->wide_x),
                 ny = LOAD_BOX(node, b->near_y) - (from[1] + b->wide_y),
                 fy = LOAD_BOX(node, b->far_y) - (from[1] - b->wide_y),
                 nz = LOAD_BOX(node, b->near_z) - (from[2] + b->wide_z),
                 fz = LOAD_BOX(node, b->far_z) - (from[2] - b->wide_z);
  enter_t->v =
      larger_of(larger_of(smaller_of(nx * b->ix.low, nx * b->ix.high), smaller_of(ny * b->iy.low, ny * b->iy.high)),
                larger_of(smaller_of(nz * b->iz.low, nz * b->iz.high), 0.0f));
  const BoxFloat leave_t =
      smaller_of(smaller_of(larger_of(fx * b->ix.low, fx * b->ix.high), larger_of(fy * b->iy.low, fy * b->iy.high)),
                 smaller_of(larger_of(fz * b->iz.low, fz * b->iz.high), limit));
  return box_bits(0.999999f * enter_t->v <= 1.000001f * leave_t);
}

/* A child that waits, and where the bundle enters it. */
typedef struct {
  int child[TRACE_STACK(BOX_WIDTH)];
  float enter[TRACE_STACK(BOX_WIDTH)];
  int size;
} BundleStack;

/* As keep_children. */
__attribute__((always_inline)) INLINE int keep_children_of_bundle(__global const float* node, uint bits,
                                                                  const BoxLanes* enter_t, BundleStack* stack) {
  __global const int* child = (__global const int*)(node + NODE_CHILD * BOX_WIDTH);
  const int first = LOWEST_BIT(bits);
  bits &= bits - 1;
  int current = child[first];
  float nearest = enter_t->f[first];
  FOR_EACH_LANE(l, bits) {
    const float enter = enter_t->f[l];
    const int code = child[l];
    const bool closer = enter < nearest;
    stack->child[stack->size] = closer ? current : code;
    stack->enter[stack->size++] = closer ? nearest : enter;
    current = closer ? code : current;
    nearest = closer ? enter : nearest;
  }
  return current;
}

/* The closest hits so far, a lane each. */
typedef struct {
  REAL t, u, v;
  REAL3 position;
  INT primitive; /* within the geometry */
} Closest;

/* The triangles of a block against all rays of the bundle. */
__attribute__((always_inline)) INLINE void triangles_of_bundle(__global const float* block, const Bundle* b,
                                                               const RaySetup* setup, Closest* closest) {
  const uint candidates = met_by_bundle(block, b->axes, b->seen_from, b->slope_x, b->slope_y, b->margin);
  FOR_EACH_LANE(l, candidates) {
    BoxFloat vertex[9];
    UNROLL_FOR(int k = 0; k < 3; ++k) {
      vertex[k] = (BoxFloat)(block[b->axes[k] + BLOCK_A * BOX_WIDTH + l]);
      vertex[3 + k] = (BoxFloat)(block[b->axes[k] + BLOCK_B * BOX_WIDTH + l]);
      vertex[6 + k] = (BoxFloat)(block[b->axes[k] + BLOCK_C * BOX_WIDTH + l]);
    }
    Crossing crossing;
    const BoxInt crossed = b->mask & crosses(vertex, setup->across_x.real, setup->across_y.real, setup->across_z.real,
                                             setup->slope_x.real, setup->slope_y.real, &crossing);
    if (!box_bits(crossed)) continue;
    REAL t, u, v, inverse;
    const BoxInt counts = crossing_distance(&crossing, setup->slope_z.real, -block[BLOCK_TOLERANCE * BOX_WIDTH + l],
                                            closest->t, &t, &u, &v, &inverse);
    const int index = as_int(block[BLOCK_PRIMITIVE * BOX_WIDTH + l]);
    const MASK closer = crossed & counts & ((t < closest->t) | ((t == closest->t) & (index < closest->primitive)));
    closest->t = SELECT(closer, t, closest->t);
    closest->u = SELECT(closer, u, closest->u);
    closest->v = SELECT(closer, v, closest->v);
    closest->primitive = SELECT_INT(closer, index, closest->primitive);
    closest->position = select3(closer, position_on_triangle(block + l, u, v), closest->position);
  }
}

/* start: as in RaySetup */
INLINE void store_hits(__global const GeometryRecord* record, const Closest* closest, REAL start, LaneHits* hits) {
  const MASK hit = closest->primitive >= 0;
  hits->primitive.integer = SELECT_INT(hit, closest->primitive + (int)record->first_primitive, -1);
  hits->distance.real = SELECT(hit, MAX(closest->t, (REAL)(0.0f)) + start, INFINITY);
  hits->u.real = closest->u;
  hits->v.real = closest->v;
  hits->x.real = closest->position.x;
  hits->y.real = closest->position.y;
  hits->z.real = closest->position.z;
}

/* Rays in vacuum from nearly the same origin. False: they go too different ways, and nothing is found out. */
INLINE bool trace_coherent(Surfaces surfaces, REAL3 origin, REAL3 direction, MASK mask, LaneHits* hits) {
  __global const GeometryRecord* record = surfaces.record;
  RaySetup setup;
  mask = mask & set_up_rays(record, origin, direction, &setup);
  Closest closest = {(REAL)(INFINITY), (REAL)(0.0f), (REAL)(0.0f), origin, (INT)(-1)};
  store_hits(record, &closest, setup.start.real, hits);
  const uint bits = lane_bits(mask);
  if (bits == 0 || record->root == CHILD_NONE) return true;
  Bundle bundle;
  if (!bundle_rays(record, &setup, origin, mask, bits, &bundle)) return false;

  float limit = INFINITY; /* the farthest of the hits so far, from the common origin */
  BundleStack stack;
  stack.size = 0;
  int current = record->root;
  for (;;) {
    if (CHILD_IS_NODE(current)) {
      __global const float* node = surfaces.nodes + (size_t)current * (NODE_ROWS * BOX_WIDTH);
      BoxLanes enter_t;
      const uint met = boxes_of_bundle(node, &bundle, limit, &enter_t);
      if (met) {
        current = keep_children_of_bundle(node, met, &enter_t, &stack);
        continue;
      }
    } else {
      __global const float* block = surfaces.leaves + (size_t)CHILD_BLOCK_INDEX(current) * (BLOCK_ROWS * BOX_WIDTH);
      triangles_of_bundle(block, &bundle, &setup, &closest);
      limit = -least_lane(SELECT(mask, -(MAX(closest.t, (REAL)(0.0f)) + setup.start.real), 0.0f));
    }
    do {
      if (stack.size == 0) {
        store_hits(record, &closest, setup.start.real, hits);
        return true;
      }
      current = stack.child[--stack.size];
    } while (0.999999f * stack.enter[stack.size] >= 1.000001f * limit);
  }
}
#endif

#endif
