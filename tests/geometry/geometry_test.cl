// Runs kernels/geometry/trace.h alone: each work-item traces `each` rays, one after another.
#include "geometry/flight_grid.h"
#include "geometry/surface_frame.h"
#include "geometry/trace.h"

typedef struct {
  float origin[3], direction[3];
  float t_max;
  int skip, inside;
} TestRay;

__kernel void sizes(__global int* out) {
  out[0] = sizeof(PrimitiveRecord);
  out[1] = sizeof(GeometryRecord);
  out[2] = sizeof(Hit);
}

__kernel void trace_rays(__global const float* nodes, __global const float* leaves,
                         __global const PrimitiveRecord* primitives, __global const GeometryRecord* record,
                         __global const TestRay* rays, __global Hit* hits, int each) {
  const Surfaces surfaces = surfaces_of(nodes, leaves, primitives, record);
  const size_t first = get_global_id(0) * (size_t)each;
  for (size_t i = first; i < first + each; ++i) {
    const TestRay r = rays[i];
    hits[i] = trace(surfaces, vload3(0, rays[i].origin), vload3(0, rays[i].direction), r.t_max, r.skip, r.inside != 0);
  }
}

inline float next(uint* state) {
  *state = *state * 747796405u + 2891336453u;
  const uint w = ((*state >> ((*state >> 28) + 4)) ^ *state) * 277803737u;
  return (float)(((w >> 22) ^ w) >> 8) * 0x1p-24f;
}

inline float3 random_direction(uint* state) {
  const float z = 2.0f * next(state) - 1.0f, phi = 6.2831853f * next(state), r = sqrt(1.0f - z * z);
  return (float3)(r * cos(phi), r * sin(phi), z);
}

// Random walks inside one closed mesh: scatters with mean free path `mean`, reflects at the surface. Counts segments
// and what must not happen: no surface before infinity, or a front face.
__kernel void walk(__global const float* nodes, __global const float* leaves,
                   __global const PrimitiveRecord* primitives, __global const GeometryRecord* record, float x, float y,
                   float z, float mean, int segments, uint seed, __global uint* counts) {
  const Surfaces surfaces = surfaces_of(nodes, leaves, primitives, record);
  uint state = seed + (uint)get_global_id(0) * 0x9E3779B9u;
  uint escaped = 0, front = 0, surface = 0;
  float3 p = (float3)(x, y, z), d = random_direction(&state);
  int skip = -1;
  for (int i = 0; i < segments; ++i) {
    const float flight = mean > 0 ? -mean * log(1.0f - next(&state)) : 1e30f;
    const Hit hit = trace(surfaces, p, d, flight, skip, true);
    if (hit.primitive < 0) {
      if (flight >= 1e30f || fabs(p.x + flight * d.x - x) > 10.0f) {
        ++escaped;
        p = (float3)(x, y, z);
      } else {
        p += flight * d;
      }
      d = random_direction(&state);
      skip = -1;
      continue;
    }
    ++surface;
    __global const PrimitiveRecord* q = primitives + hit.primitive;
    float3 n = (float3)(q->normal[0], q->normal[1], q->normal[2]);
    p = (float3)(hit.x, hit.y, hit.z);
    if (q->flags & PRIMITIVE_SPHERE) n = normalize(p - n);
    skip = hit.primitive;
    if (hit.front) {
      ++front;
      p = (float3)(x, y, z);
      skip = -1;
      d = random_direction(&state);
      continue;
    }
    // A grazing, a mirrored or a random direction inwards.
    const float kind = next(&state);
    const float3 r = random_direction(&state);
    if (kind < 0.2f)
      d = normalize(d - dot(d, n) * n - 1e-4f * next(&state) * n);
    else if (kind < 0.5f)
      d = d - 2.0f * dot(d, n) * n;
    else
      d = dot(r, n) > 0 ? -r : r;
    if (!(dot(d, n) < 0)) d = -n;
    p -= q->offset * n;
  }
  counts[3 * get_global_id(0)] = escaped;
  counts[3 * get_global_id(0) + 1] = front;
  counts[3 * get_global_id(0) + 2] = surface;
}

// The rays of paths that enter the medium, scatter with an albedo, and start again where they entered when absorbed.
__kernel void record_paths(__global const float* nodes, __global const float* leaves,
                           __global const PrimitiveRecord* primitives, __global const GeometryRecord* record, float x,
                           float y, float z, float mean, float albedo, int segments, uint seed,
                           __global TestRay* rays) {
  const Surfaces surfaces = surfaces_of(nodes, leaves, primitives, record);
  uint state = seed + (uint)get_global_id(0) * 0x9E3779B9u;
  float3 p = (float3)(x, y, z), d = random_direction(&state), entry = p, n = d;
  int skip = -1, entry_primitive = -1;
  for (int i = -100; i < segments; ++i) {
    const float flight = i < 0 ? 1e30f : -mean * log(1.0f - next(&state));
    if (i >= 0) {
      __global TestRay* r = rays + get_global_id(0) * (size_t)segments + i;
      vstore3(p, 0, r->origin);
      vstore3(d, 0, r->direction);
      r->t_max = flight;
      r->skip = skip;
      r->inside = 1;
    }
    const Hit hit = trace(surfaces, p, d, flight, skip, true);
    if (hit.primitive >= 0) {
      __global const PrimitiveRecord* q = primitives + hit.primitive;
      n = (float3)(q->normal[0], q->normal[1], q->normal[2]);
      entry = (float3)(hit.x, hit.y, hit.z) - q->offset * n;
      entry_primitive = hit.primitive;
    } else if (next(&state) < albedo) {
      p += flight * d;
      d = random_direction(&state);
      skip = -1;
      continue;
    }
    p = entry;
    skip = entry_primitive;
    d = random_direction(&state);
    if (dot(d, n) > 0) d = -d;
  }
}

// kernels/geometry/flight_grid.h alone: rays are origin, direction, distance, one component after another.
__kernel void fly(__global const uint* grid, __global const GeometryRecord* record, __global const float* rays,
                  __global int* clear, __global float* distance, int n) {
  const INT at = (int)get_global_id(0) * WIDTH + LANE_INDEX;
#define COMPONENT(k) GATHER((rays + (k)*n), at)
  const REAL3 o = make3(COMPONENT(0), COMPONENT(1), COMPONENT(2)), d = make3(COMPONENT(3), COMPONENT(4), COMPONENT(5));
  const REAL flight = COMPONENT(6);
  const FlightCell cell = flight_cell(grid, record, o), end = flight_cell(grid, record, add3(o, scale3(d, flight)));
  const MASK result = flight_is_clear(record, &cell, &end, d, flight) & (at >= 0);
  SCATTER_INT(clear, at, SELECT_INT(result, 1, 0));
  SCATTER(distance, at, surface_distance(record, &cell));
}

// geometry/surface_frame.h at hits: normal, shading normal, texture coordinates, and beside_surface() along +z.
__kernel void frames(__global const PrimitiveRecord* primitives, __global const Hit* hits, __global float* out) {
  const INT at = (int)get_global_id(0) * WIDTH + LANE_INDEX;
  __global const float* h = (__global const float*)hits;
  const INT word = at * (int)(sizeof(Hit) / sizeof(float));
#define MEMBER(k) GATHER((h + (k)), word)
  const INT primitive = GATHER_INT(((__global const int*)hits + 6), word);
  const REAL3 position = make3(MEMBER(3), MEMBER(4), MEMBER(5));
  REAL3 normal, shading;
  REAL texture[2];
  surface_frame(primitives, primitive, MEMBER(1), MEMBER(2), position, &normal, &shading, texture);
  const REAL3 up = make3((REAL)(0.0f), (REAL)(0.0f), (REAL)(1.0f));
  const REAL3 beside = beside_surface(primitives, primitive, position, normal, up);
  const REAL values[11] = {normal.x,   normal.y,   normal.z, shading.x, shading.y, shading.z,
                           texture[0], texture[1], beside.x, beside.y,  beside.z};
  for (int k = 0; k < 11; ++k) SCATTER(out, at * 11 + k, values[k]);
}
