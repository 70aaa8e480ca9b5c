/* The textures. TEXTURE(name, PREFIX, type): name.h beside this file declares the colours that it is made of and has
 * the function below; type: of the element in scene files.
 *
 *   PREFIX_COLOURS(COLOUR)    what people set, by Mitsuba's names: COLOUR(name, kind, fallback), kind as of parameters
 *                             (shared/declaration.h)
 *   name_value(t, texels, number, at, rgb)
 *                             the value at that place of the surface, its coordinates after to_uv, of the record t;
 *                             number: that for which the texture stands, as shared/scene_layout.h says. Returns which
 *                             of its colours the value is, from 1 on: what is differentiated by them. 0: none of them
 *   name_texels(t, texels, at, which, weight)
 *                             the texels that the value is a sum of, by their numbers from 0 on, and their weights.
 *                             Returns how many: 0 where it is made of colours
 *   PREFIX_TRAITS             TEXTURE_ON_MESH: it must know the primitive and the place on it;
 *                             TEXTURE_IN_SPACE: the position in the world
 *
 * One path at a time: surfaces side by side show different textures. */
#ifndef ITN_TEXTURE_LIST_H
#define ITN_TEXTURE_LIST_H
#include "shared/portable.h"
#include "shared/scene_layout.h"

#define TEXTURE_ON_MESH 1
#define TEXTURE_IN_SPACE 2

#ifdef __OPENCL_VERSION__
/* The place where one path looks a texture up. primitive, shape, b1, b2 (barycentric, of the second and third
 * corner): where there are attributes (HAS_ATTRIBUTES), and on meshes alone; x, y, z: where there are volumes
 * (HAS_VOLUME_TEXTURES) */
typedef struct {
  float u, v;
#if HAS_ATTRIBUTES
  float b1, b2;
  int primitive, shape; /* of the launch; of the scene */
#endif
#if HAS_VOLUME_TEXTURES
  float x, y, z;
#endif
} TexturePlace;
#endif

#include "model/texture/bitmap.h"
#include "model/texture/checkerboard.h"
#include "model/texture/mesh_attribute.h"
#include "model/texture/volume.h"

#define TEXTURE_LIST(TEXTURE)                               \
  TEXTURE(bitmap, BITMAP, "bitmap")                         \
  TEXTURE(checkerboard, CHECKERBOARD, "checkerboard")       \
  TEXTURE(mesh_attribute, MESH_ATTRIBUTE, "mesh_attribute") \
  TEXTURE(volume, VOLUME, "volume")

#define NUMBER_TEXTURE(name, PREFIX, type) TEXTURE_##name,
enum { TEXTURE_LIST(NUMBER_TEXTURE) TEXTURES };

#endif
