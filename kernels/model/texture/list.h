/* The textures. TEXTURE(name, PREFIX, type): name.h beside this file declares the colours that it is made of and has
 * the function below; type: of the element in scene files.
 *
 *   PREFIX_COLOURS(COLOUR)    what people set, by Mitsuba's names: COLOUR(name, kind, fallback), kind as of parameters
 *                             (shared/declaration.h)
 *   name_value(t, texels, number, u, v, rgb)
 *                             the value where the surface has the coordinates (u, v), after to_uv, of the record t;
 *                             number: that for which the texture stands, as shared/scene_layout.h says. Returns which
 *                             of its colours the value is, from 1 on: what is differentiated by them. 0: none of them
 *
 * One path at a time: surfaces side by side show different textures. */
#ifndef ITN_TEXTURE_LIST_H
#define ITN_TEXTURE_LIST_H
#include "shared/portable.h"
#include "shared/scene_layout.h"

#include "model/texture/bitmap.h"
#include "model/texture/checkerboard.h"

#define TEXTURE_LIST(TEXTURE)       \
  TEXTURE(bitmap, BITMAP, "bitmap") \
  TEXTURE(checkerboard, CHECKERBOARD, "checkerboard")

#define NUMBER_TEXTURE(name, PREFIX, type) TEXTURE_##name,
enum { TEXTURE_LIST(NUMBER_TEXTURE) TEXTURES };

#endif
