/* Stage shadow: follows a light connection through index-matched boundaries and media; what arrives is added. Then the
 * path goes on, or ends (DEPTH < 0). */
#ifndef ITN_STAGE_SHADOW_H
#define ITN_STAGE_SHADOW_H
#include "stage/surface.h"

#if LIGHT_SAMPLING
/* Optical depth per throughput channel from o towards d to outside the scene; false: something opaque or refractive is in
 * the way. */
inline bool optical_depth(const Launch* launch, __global const JobRecord* job, float o[3], const float d[3], int skip,
                          int medium, float depth[THROUGHPUT_CHANNELS]) {
  const Surfaces surfaces =
      surfaces_of(launch->nodes, launch->leaves, launch->primitives, launch->geometries + job->geometry);
  for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) depth[c] = 0.0f;
  for (;;) {
    const Hit hit = trace(surfaces, o[0], o[1], o[2], d[0], d[1], d[2], INFINITY, skip, medium >= 0);
    if (hit.primitive < 0) return medium < 0;
    __global const PrimitiveRecord* primitive = launch->primitives + hit.primitive;
    __global const ShapeRecord* shape = launch->shapes + job->first_shape + primitive->shape;
    if (launch->bsdfs[shape->bsdf].kind != BSDF_NULL) return false;
    o[0] = hit.x;
    o[1] = hit.y;
    o[2] = hit.z;
    float facing = 0.0f;
    for (int k = 0; k < 3; ++k)
      facing += d[k] * (primitive->flags & PRIMITIVE_SPHERE ? o[k] - primitive->normal[k] : primitive->normal[k]);
    if ((primitive->flags & PRIMITIVE_SPHERE) && (primitive->flags & PRIMITIVE_FLIPPED)) facing = -facing;
    for (int k = 0; k < 3; ++k)
      if (!(primitive->flags & PRIMITIVE_SPHERE)) o[k] += copysign(primitive->offset, facing) * primitive->normal[k];
#if HAS_MEDIUM
    if (medium >= 0)
      for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) depth[c] += launch->media[medium].sigma_t[c] * hit.t;
#endif
    if (shape->interior != shape->exterior) medium = facing < 0.0f ? shape->interior : shape->exterior;
    skip = hit.primitive;
  }
}

inline void shadow_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  Lanes slot;
  slot.integer = slots;
  uint bits = lane_bits(valid);
  __global float* fields = pool->fields;
  __global const int* ints = (__global const int*)pool->fields;
  int stride = pool->stride;
  FOR_EACH_LANE(l, bits) {
    int s = slot.i[l];
    float o[3], d[3], depth[THROUGHPUT_CHANNELS];
    for (int k = 0; k < 3; ++k) {
      o[k] = fields[(POSITION_X + k) * stride + s];
      d[k] = fields[(SHADOW_X + k) * stride + s];
    }
    if (!optical_depth(launch, job, o, d, ints[SKIP * stride + s], ints[MEDIUM * stride + s], depth)) continue;
    for (int c = 0; c < RADIANCE_CHANNELS; ++c)
      fields[(RADIANCE + c) * stride + s] +=
          fields[(SHADOW_WEIGHT + c) * stride + s] * exp(-depth[THROUGHPUT_CHANNELS == 1 ? 0 : c]);
  }
  MASK ends = valid & (LOAD_INT(pool, DEPTH, slots) < 0);
  MASK in_vacuum = valid & (LOAD_INT(pool, MEDIUM, slots) < 0);
  finish(launch, job, pool, slots, ends);
  push(pool, QUEUE_RAY, slots, valid & !ends & in_vacuum);
#if HAS_MEDIUM
  push(pool, QUEUE_MEDIUM, slots, valid & !ends & !in_vacuum);
#endif
}
#endif

#endif
