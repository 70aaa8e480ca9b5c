/* The closest surfaces along rays that start together and stay together, such as those of one pixel: the hierarchy is walked
 * once for all of them, and each triangle that the bundle may meet is tested against all of them at once. The same hits, bit
 * for bit, as trace_lanes finds, whose tests of the single ray decide here too; boxes and triangles are only left out where
 * a bound over the bundle says that no ray can meet them. */
#ifndef ITN_TRACE_COHERENT_H
#define ITN_TRACE_COHERENT_H
#include "lib/trace.h"

#if WIDTH == BOX_WIDTH && !HAS_ROUND
/* Over all lanes. */
inline float least_lane(REAL v) {
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

inline Range range_of(REAL v) {
  Range r = {least_lane(v), -least_lane(-v)};
  return r;
}

/* May triangles of this block be met? Bounds on their vertices' coordinates across the rays, as in Crossing. */
inline uint met_by_bundle(__global const float* block, const int axes[3], const float origin[3], Range slope_x,
                          Range slope_y, float margin) {
  BoxFloat low_x = INFINITY, high_x = -INFINITY, low_y = INFINITY, high_y = -INFINITY;
  UNROLL for (int vertex = 0; vertex < 3; ++vertex) {
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

/* Rays in vacuum from nearly the same origin. False: they go too different ways, and nothing is found out. */
inline bool trace_coherent(Surfaces surfaces, REAL3 origin, REAL3 direction, MASK mask, LaneHits* hits) {
  __global const GeometryRecord* record = surfaces.record;
  RaySetup setup;
  mask = mask & set_up_rays(record, origin, direction, &setup);
  hits->x.real = origin.x;
  hits->y.real = origin.y;
  hits->z.real = origin.z;
  hits->distance.real = (REAL)(INFINITY);
  hits->primitive.integer = (INT)(-1);
  hits->u.real = (REAL)(0.0f);
  hits->v.real = (REAL)(0.0f);
  const uint bits = lane_bits(mask);
  if (bits == 0 || record->root == CHILD_NONE) return true;

  const int first = LOWEST_BIT(bits);
  Lanes x, y, z;
  x.real = origin.x;
  y.real = origin.y;
  z.real = origin.z;
  const int axes[3] = {setup.kx.i[first], setup.ky.i[first], setup.kz.i[first]};
  const float sign_x = setup.ix.f[first], sign_y = setup.iy.f[first], sign_z = setup.iz.f[first];
  const MASK together = (setup.kz.integer == axes[2]) & (setup.ix.real * sign_x > 0.0f) &
                        (setup.iy.real * sign_y > 0.0f) & (setup.iz.real * sign_z > 0.0f);
  if (ANY(mask & !together)) return false;

  /* Of the bundle: idle lanes repeat the first. */
  const float from[3] = {x.f[first], y.f[first], z.f[first]};
  const Range ix = range_of(SELECT(mask, setup.ix.real, sign_x)), iy = range_of(SELECT(mask, setup.iy.real, sign_y)),
              iz = range_of(SELECT(mask, setup.iz.real, sign_z));
  const Range slope_x = range_of(SELECT(mask, setup.slope_x.real, setup.slope_x.f[first])),
              slope_y = range_of(SELECT(mask, setup.slope_y.real, setup.slope_y.f[first]));
  /* The single rays' tests are exact to some roundings of coordinates, theirs and the scene's; and they start a little beside
   * the first. */
  float extent = 0.0f;
  UNROLL for (int k = 0; k < 3; ++k) extent += max(fabs(record->low[k] - from[k]), fabs(record->high[k] - from[k])) + fabs(from[k]);
  const REAL beside = MAX(MAX(ABS(origin.x - from[0]), ABS(origin.y - from[1])), ABS(origin.z - from[2]));
  const float margin = 1e-6f * extent - 2.0f * least_lane(SELECT(mask, -beside, 0.0f));
  const float seen_from[3] = {from[axes[0] / BOX_WIDTH], from[axes[1] / BOX_WIDTH], from[axes[2] / BOX_WIDTH]};

  const int near_x = NODE_LOW_X + (sign_x < 0), near_y = NODE_LOW_Y + (sign_y < 0), near_z = NODE_LOW_Z + (sign_z < 0);
  const int far_x = NODE_LOW_X + NODE_HIGH_X - near_x, far_y = NODE_LOW_Y + NODE_HIGH_Y - near_y,
            far_z = NODE_LOW_Z + NODE_HIGH_Z - near_z;
  const float wide_x = copysign(margin, sign_x), wide_y = copysign(margin, sign_y), wide_z = copysign(margin, sign_z);

  REAL t = (REAL)(INFINITY), u = (REAL)(0.0f), v = (REAL)(0.0f);
  REAL3 position = origin;
  INT primitive = (INT)(-1);
  float limit = INFINITY; /* the farthest of the hits so far, from the common origin */
  int stack[TRACE_STACK(BOX_WIDTH)];
  float stack_t[TRACE_STACK(BOX_WIDTH)];
  int size = 0;
  int current = record->root;
  for (;;) {
    if (CHILD_IS_NODE(current)) {
      __global const float* node = surfaces.nodes + (size_t)current * (NODE_ROWS * BOX_WIDTH);
      const BoxFloat nx = LOAD_BOX(node, near_x) - (from[0] + wide_x), ny = LOAD_BOX(node, near_y) - (from[1] + wide_y),
                     nz = LOAD_BOX(node, near_z) - (from[2] + wide_z), fx = LOAD_BOX(node, far_x) - (from[0] - wide_x),
                     fy = LOAD_BOX(node, far_y) - (from[1] - wide_y), fz = LOAD_BOX(node, far_z) - (from[2] - wide_z);
      BoxLanes enter_t;
      enter_t.v = larger_of(larger_of(smaller_of(nx * ix.low, nx * ix.high), smaller_of(ny * iy.low, ny * iy.high)),
                            larger_of(smaller_of(nz * iz.low, nz * iz.high), 0.0f));
      const BoxFloat leave_t =
          smaller_of(smaller_of(larger_of(fx * ix.low, fx * ix.high), larger_of(fy * iy.low, fy * iy.high)),
                     smaller_of(larger_of(fz * iz.low, fz * iz.high), limit));
      uint inside = box_bits(0.999999f * enter_t.v <= 1.000001f * leave_t);
      if (inside) {
        __global const int* child = (__global const int*)(node + NODE_CHILD * BOX_WIDTH);
        const int nearest_child = LOWEST_BIT(inside);
        inside &= inside - 1;
        current = child[nearest_child];
        float nearest = enter_t.f[nearest_child];
        FOR_EACH_LANE(l, inside) {
          const float enter = enter_t.f[l];
          const int code = child[l];
          const bool closer = enter < nearest;
          stack[size] = closer ? current : code;
          stack_t[size++] = closer ? nearest : enter;
          current = closer ? code : current;
          nearest = closer ? enter : nearest;
        }
        continue;
      }
    } else {
      __global const float* block = surfaces.leaves + (size_t)CHILD_BLOCK_INDEX(current) * (BLOCK_ROWS * BOX_WIDTH);
      const uint candidates = met_by_bundle(block, axes, seen_from, slope_x, slope_y, margin);
      FOR_EACH_LANE(l, candidates) {
        BoxFloat vertex[9];
        UNROLL for (int k = 0; k < 3; ++k) {
          vertex[k] = (BoxFloat)(block[axes[k] + BLOCK_A * BOX_WIDTH + l]);
          vertex[3 + k] = (BoxFloat)(block[axes[k] + BLOCK_B * BOX_WIDTH + l]);
          vertex[6 + k] = (BoxFloat)(block[axes[k] + BLOCK_C * BOX_WIDTH + l]);
        }
        Crossing crossing;
        const BoxInt crossed = mask & crosses(vertex, setup.across_x.real, setup.across_y.real, setup.across_z.real,
                                              setup.slope_x.real, setup.slope_y.real, &crossing);
        if (!box_bits(crossed)) continue;
        REAL distance, b, c, inverse;
        const BoxInt counts = crossing_distance(&crossing, setup.slope_z.real, -block[BLOCK_TOLERANCE * BOX_WIDTH + l], t,
                                                &distance, &b, &c, &inverse);
        const int index = as_int(block[BLOCK_PRIMITIVE * BOX_WIDTH + l]);
        const MASK closer = crossed & counts & ((distance < t) | ((distance == t) & (index < primitive)));
        t = SELECT(closer, distance, t);
        u = SELECT(closer, b, u);
        v = SELECT(closer, c, v);
        primitive = SELECT_INT(closer, index, primitive);
        position = select3(closer, position_on_triangle(block + l, b, c), position);
      }
      limit = -least_lane(SELECT(mask, -(MAX(t, (REAL)(0.0f)) + setup.start.real), 0.0f));
    }
    do {
      if (size == 0) {
        const MASK hit = primitive >= 0;
        hits->primitive.integer = SELECT_INT(hit, primitive + (int)record->first_primitive, -1);
        hits->distance.real = SELECT(hit, MAX(t, (REAL)(0.0f)) + setup.start.real, INFINITY);
        hits->u.real = u;
        hits->v.real = v;
        hits->x.real = position.x;
        hits->y.real = position.y;
        hits->z.real = position.z;
        return true;
      }
      current = stack[--size];
    } while (0.999999f * stack_t[size] >= 1.000001f * limit);
  }
}
#endif

#endif
