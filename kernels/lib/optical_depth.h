/* What dims a light connection on its way: index-matched boundaries and media are passed, anything else blocks it. */
#ifndef ITN_OPTICAL_DEPTH_H
#define ITN_OPTICAL_DEPTH_H
#include "lib/launch.h"

/* One ray. Optical depth per throughput channel from o towards d to outside the scene; false: something opaque or
 * refractive is in the way. */
inline bool optical_depth(const Launch* launch, __global const JobRecord* job, float o[3], const float d[3], int skip,
                          int medium, float depth[THROUGHPUT_CHANNELS]) {
  const Surfaces surfaces =
      surfaces_of(launch->nodes, launch->leaves, launch->primitives, launch->geometries + job->geometry);
  for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) depth[c] = 0.0f;
  bool passed = false; /* a boundary: nothing behind counts, or thin bodies would be passed again and again */
  for (;;) {
    const Hit hit = trace_onward(surfaces, o[0], o[1], o[2], d[0], d[1], d[2], INFINITY, skip, medium >= 0, passed);
    passed = true;
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

/* Adds weight * light, dimmed on the way, to the radiance of the lanes in `mask`: from `from` in `medium` towards `to`.
 */
inline void add_connection(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK mask,
                           REAL3 from, REAL3 to, INT skip, INT medium, const REAL weight[RADIANCE_CHANNELS]) {
  Lanes slot, ox, oy, oz, dx, dy, dz, first, in, w[RADIANCE_CHANNELS];
  slot.integer = slots;
  ox.real = from.x;
  oy.real = from.y;
  oz.real = from.z;
  dx.real = to.x;
  dy.real = to.y;
  dz.real = to.z;
  first.integer = skip;
  in.integer = medium;
  for (int c = 0; c < RADIANCE_CHANNELS; ++c) w[c].real = weight[c];
  const uint bits = lane_bits(mask);
  FOR_EACH_LANE(l, bits) {
    float o[3] = {ox.f[l], oy.f[l], oz.f[l]}, depth[THROUGHPUT_CHANNELS];
    const float d[3] = {dx.f[l], dy.f[l], dz.f[l]};
    if (!optical_depth(launch, job, o, d, first.i[l], in.i[l], depth)) continue;
    for (int c = 0; c < RADIANCE_CHANNELS; ++c)
      pool->fields[(RADIANCE + c) * pool->stride + slot.i[l]] +=
          w[c].f[l] * exp(-depth[THROUGHPUT_CHANNELS == 1 ? 0 : c]);
  }
}

#endif
