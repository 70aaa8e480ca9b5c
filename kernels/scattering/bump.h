/* Bump maps: how the slopes of a texture bend the normal. The surface is displaced along its shading normal n by a height, whose
 * growth along n changes dp/du and dp/dv; how n itself turns is left out, as in Mitsuba.
 * Tests: tests/transport (images of Mitsuba 3.9.1) */
#ifndef ITN_BUMP_H
#define ITN_BUMP_H
#include "program/scores.h"
#include "geometry/surface_frame.h"
#include "model/nest/bump_map.h"

/* dp/du and dp/dv of the surface, in the world. */
typedef struct {
  REAL3 u, v;
} TextureAxes;

#if HAS_ROUND
INLINE void round_axes(__global const float* record, INT at, INT flags, REAL3 position, REAL3 normal,
                       TextureAxes* axes) {
  const MASK sphere = (flags & PRIMITIVE_SPHERE) != 0, cylinder = (flags & PRIMITIVE_CYLINDER) != 0;
  if (!ANY(sphere | cylinder)) return;
  const REAL3 from = sub3(position, gather3(record, at)), last = gather3(record + PRIMITIVE_AT_FRAME + 6, at);
  const REAL3 axis = scale3(last, 1.0f / SQRT(dot3(last, last)));
  const REAL height = dot3(from, axis);
  const REAL3 radial = sub3(from, scale3(axis, height));
  const REAL radius = SQRT(dot3(radial, radial));
  /* a turn is one unit of u, half a turn from pole to pole or the length of the cylinder one of v */
  axes->u = select3(sphere | cylinder, scale3(cross3(axis, radial), 6.28318531f), axes->u);
  const REAL3 down = sub3(scale3(radial, height / MAX(radius, (REAL)(1e-20f))), scale3(axis, radius));
  axes->v =
      select3(sphere, scale3(down, 3.14159265f), select3(cylinder, scale3(last, 1.0f / dot3(last, last)), axes->v));
}
#endif

INLINE void store_normal(REAL3 normal, REAL n[3]) {
  n[0] = normal.x;
  n[1] = normal.y;
  n[2] = normal.z;
}

/* triangles: as of launch_arguments.h */
INLINE TextureAxes texture_axes(__global const PrimitiveRecord* primitives, __global const float* triangles,
                                INT primitive, REAL3 position, REAL3 normal) {
  TextureAxes axes;
  const Frame frame = make_frame(normal);
  const INT own = 4 * primitive;
  axes.u = frame_to_world(&frame, make3(GATHER(triangles, own), GATHER((triangles + 1), own), (REAL)(0.0f)));
  axes.v = frame_to_world(&frame, make3(GATHER((triangles + 2), own), GATHER((triangles + 3), own), (REAL)(0.0f)));
#if HAS_ROUND
  __global const float* record = (__global const float*)primitives;
  const INT at = primitive * (int)(sizeof(PrimitiveRecord) / sizeof(float));
  round_axes(record, at, GATHER_INT(((__global const int*)(record + PRIMITIVE_AT_FLAGS)), at), position, normal, &axes);
#endif
  return axes;
}

/* n: of a bump map (model/nest/bump_map.h), whose first numbers are d height / d u and d height / d v without `scale`;
 * they become the bent normal in the frame, on the geometric normal's side. */
INLINE void bend_by_slopes(REAL n[], const TextureAxes* axes, REAL3 normal, const Frame* frame) {
  REAL slopes[2] = {n[BUMP_MAP_texture] * n[BUMP_MAP_scale], n[BUMP_MAP_texture + 1] * n[BUMP_MAP_scale]};
#if TEXEL_SUMS
  UNROLL_FOR(int k = 0; k < 2; ++k) {
    const int to = k == 0 ? BUMP_MAP_along_u : BUMP_MAP_along_v;
    REAL grows[2] = {(REAL)(0.0f), (REAL)(0.0f)}, along[3];
    grows[k] = n[BUMP_MAP_scale];
    derivative_bumped_normal(axes->u, axes->v, frame->n, normal, slopes, grows, along);
    store_normal(frame_to_local(frame, make3(along[0], along[1], along[2])), n + to);
  }
#endif
  store_normal(frame_to_local(frame, bumped_normal(axes->u, axes->v, frame->n, normal, slopes[0], slopes[1])),
               n + BUMP_MAP_texture);
}

#endif
