/* The places where the paths of a group look textures up. */
#ifndef ITN_TEXTURE_PLACES_H
#define ITN_TEXTURE_PLACES_H
#include "path/launch.h"
#include "geometry/surface_frame.h"
#include "texture/texture.h"

/* A lane each, as surface_frame() tells it. */
typedef struct {
  Lanes u, v;
#if HAS_ATTRIBUTES
  Lanes b1, b2, primitive;
#endif
#if HAS_VOLUME_TEXTURES
  Lanes x, y, z;
#endif
} TexturePlaces;

INLINE TexturePlaces texture_places(const REAL texture[]) {
  TexturePlaces p;
  p.u.real = texture[0];
  p.v.real = texture[1];
#if HAS_ATTRIBUTES
  p.b1.real = texture[2];
  p.b2.real = texture[3];
  p.primitive.real = texture[4];
#endif
#if HAS_VOLUME_TEXTURES
  p.x.real = texture[TEXTURE_AT_POSITION];
  p.y.real = texture[TEXTURE_AT_POSITION + 1];
  p.z.real = texture[TEXTURE_AT_POSITION + 2];
#endif
  return p;
}

INLINE TexturePlace texture_place_of(const Launch* launch, const TexturePlaces* p, int lane) {
  TexturePlace place = {p->u.f[lane], p->v.f[lane]};
#if HAS_ATTRIBUTES
  place.b1 = p->b1.f[lane];
  place.b2 = p->b2.f[lane];
  place.primitive = p->primitive.i[lane];
  place.shape = launch->primitives[place.primitive].shape;
#endif
#if HAS_VOLUME_TEXTURES
  place.x = p->x.f[lane];
  place.y = p->y.f[lane];
  place.z = p->z.f[lane];
#endif
  return place;
}

#endif
