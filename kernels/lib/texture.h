/* The textures by their records: model/texture/list.h expanded. */
#ifndef ITN_TEXTURE_H
#define ITN_TEXTURE_H
#include "model/texture/list.h"

/* Arguments and result as in model/texture/list.h, the coordinates before to_uv. */
#define TEXTURE_CASE(name, PREFIX, type) \
  case TEXTURE_##name: return name##_value(t, texels, number, to, rgb);
inline int texture_value(__global const TextureRecord* t, __global const float* texels, __global const float* number,
                         TexturePlace at, float rgb[3]) {
  TexturePlace to = at;
  to.u = t->to_uv[0] * at.u + t->to_uv[1] * at.v + t->to_uv[2];
  to.v = t->to_uv[3] * at.u + t->to_uv[4] * at.v + t->to_uv[5];
  switch (t->kind) { TEXTURE_LIST(TEXTURE_CASE) }
  return 0;
}
#undef TEXTURE_CASE

#endif
