/* The textures by their records: model/texture/list.h expanded. */
#ifndef ITN_TEXTURE_H
#define ITN_TEXTURE_H
#include "model/texture/list.h"

/* Arguments and result as in model/texture/list.h, (u, v) before to_uv. */
#define TEXTURE_CASE(name, PREFIX, type) \
  case TEXTURE_##name: return name##_value(t, texels, number, x, y, rgb);
inline int texture_value(__global const TextureRecord* t, __global const float* texels, __global const float* number,
                         float u, float v, float rgb[3]) {
  const float x = t->to_uv[0] * u + t->to_uv[1] * v + t->to_uv[2], y = t->to_uv[3] * u + t->to_uv[4] * v + t->to_uv[5];
  switch (t->kind) { TEXTURE_LIST(TEXTURE_CASE) }
  return 0;
}
#undef TEXTURE_CASE

#endif
