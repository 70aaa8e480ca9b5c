/* The textures by their records: model/texture/list.h expanded. */
#ifndef ITN_TEXTURE_H
#define ITN_TEXTURE_H
#include "shared/vector.h"
#include "model/texture/list.h"

/* Coordinates after to_uv. */
INLINE void texture_place(__global const TextureRecord* t, float u, float v, float to[2]) {
  to[0] = t->to_uv[0] * u + t->to_uv[1] * v + t->to_uv[2];
  to[1] = t->to_uv[3] * u + t->to_uv[4] * v + t->to_uv[5];
}

INLINE TexturePlace texture_moved(__global const TextureRecord* t, TexturePlace at) {
  float uv[2];
  texture_place(t, at.u, at.v, uv);
  at.u = uv[0];
  at.v = uv[1];
  return at;
}

/* Arguments and result as in model/texture/list.h, the coordinates before to_uv. */
#define TEXTURE_CASE(name, PREFIX, type) \
  case TEXTURE_##name: return name##_value(t, texels, number, to, rgb);
INLINE int texture_value(__global const TextureRecord* t, __global const float* texels, __global const float* number,
                         TexturePlace at, float rgb[3]) {
  const TexturePlace to = texture_moved(t, at);
  switch (t->kind) { TEXTURE_LIST(TEXTURE_CASE) }
  return 0;
}
#undef TEXTURE_CASE

/* The texels that it is a sum of. */
#define TEXTURE_CASE(name, PREFIX, type) \
  case TEXTURE_##name: return name##_texels(t, texels, to, which, weight);
INLINE int texture_texels(__global const TextureRecord* t, __global const float* texels, TexturePlace at, int which[4],
                          float weight[4]) {
  const TexturePlace to = texture_moved(t, at);
  switch (t->kind) { TEXTURE_LIST(TEXTURE_CASE) }
  return 0;
}
#undef TEXTURE_CASE

/* d value / d u and d value / d v of a bitmap, the same in all channels; of nearest texels: 0. */
INLINE void texture_slopes(__global const TextureRecord* t, __global const float* texels, float u, float v,
                           float slopes[3]) {
  float to[2], along[2];
  texture_place(t, u, v, to);
  bitmap_slopes(t, texels, to[0], to[1], along);
  slopes[0] = t->to_uv[0] * along[0] + t->to_uv[3] * along[1];
  slopes[1] = t->to_uv[1] * along[0] + t->to_uv[4] * along[1];
  slopes[2] = 0.0f;
}

/* The texels that these are sums of, and their weights. Returns how many. */
INLINE int texture_slope_texels(__global const TextureRecord* t, float u, float v, int which[4], float along_u[4],
                                float along_v[4]) {
  float to[2], x[4], y[4];
  texture_place(t, u, v, to);
  const int shown = bitmap_slope_texels(t, to[0], to[1], which, x, y);
  UNROLL_FOR(int k = 0; k < 4; ++k) {
    if (k >= shown) continue;
    along_u[k] = t->to_uv[0] * t->width * x[k] + t->to_uv[3] * t->height * y[k];
    along_v[k] = t->to_uv[1] * t->width * x[k] + t->to_uv[4] * t->height * y[k];
  }
  return shown;
}

#endif
