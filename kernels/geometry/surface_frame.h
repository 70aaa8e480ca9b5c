/* Geometric normal, shading normal and texture coordinates at a hit, from the primitive's record. */
#ifndef ITN_SURFACE_FRAME_H
#define ITN_SURFACE_FRAME_H
#include "geometry/frame.h"
#include "shared/geometry_layout.h"

/* The start of a path that goes on into `direction`: surely on its side of the surface, which the rounded position on
 * the surface is not (geometry/trace.h). */
INLINE REAL3 beside_surface(__global const PrimitiveRecord* primitives, INT primitive, REAL3 position, REAL3 normal,
                            REAL3 direction) {
  __global const float* record = (__global const float*)primitives;
  const REAL offset =
      GATHER((record + PRIMITIVE_AT_OFFSET), primitive * (int)(sizeof(PrimitiveRecord) / sizeof(float)));
  return add3(position, scale3(normal, SELECT(dot3(normal, direction) > 0.0f, offset, -offset)));
}

/* Three words of each lane's record, which begins at `at`. */
INLINE REAL3 gather3(__global const float* record, INT at) {
  return make3(GATHER(record, at), GATHER((record + 1), at), GATHER((record + 2), at));
}

#if HAS_ROUND
/* The normal of curved primitives: along `out`, which leaves the centre or the axis. */
INLINE void turn_out(MASK mask, INT flags, REAL3 out, REAL3* normal) {
  const REAL inverse = SELECT((flags & PRIMITIVE_FLIPPED) != 0, -1.0f, 1.0f) / SQRT(dot3(out, out));
  *normal = select3(mask, scale3(out, inverse), *normal);
}

/* normal: of the record, which holds a sphere's centre there, and the middle of a cylinder's first circle. Returns how
 * far along a cylinder's axis the position is, in its lengths. */
INLINE REAL curved_normal(__global const float* record, INT at, INT flags, REAL3 position, REAL3* normal) {
  const MASK sphere = (flags & PRIMITIVE_SPHERE) != 0, cylinder = (flags & PRIMITIVE_CYLINDER) != 0;
  if (ANY(sphere)) turn_out(sphere, flags, sub3(position, *normal), normal);
  REAL along = (REAL)(0.0f);
  if (ANY(cylinder)) {
    const REAL3 from = sub3(position, *normal), dual = gather3(record + PRIMITIVE_AT_FRAME + 6, at);
    along = dot3(from, dual);
    turn_out(cylinder, flags, sub3(from, scale3(dual, along / dot3(dual, dual))), normal);
  }
  return along;
}
#endif

#if HAS_SMOOTH
/* Between the vertices' normals, where there are some. */
INLINE REAL3 smooth_normal(__global const float* record, INT at, INT flags, REAL u, REAL v, REAL3 normal) {
  MASK smooth = (flags & PRIMITIVE_SMOOTH) != 0;
  if (!ANY(smooth)) return normal;
  record += PRIMITIVE_AT_FRAME;
  const REAL w = 1.0f - u - v;
  const REAL3 a = gather3(record, at), b = gather3(record + 3, at), c = gather3(record + 6, at);
  const REAL3 n = make3(w * a.x + u * b.x + v * c.x, w * a.y + u * b.y + v * c.y, w * a.z + u * b.z + v * c.z);
  const REAL length2 = dot3(n, n);
  smooth = smooth & (length2 > 0.0f);
  return select3(smooth, scale3(n, 1.0f / SQRT(length2)), normal);
}
#endif

#if HAS_TEXTURE
#if HAS_ROUND
/* Writes the texture coordinates of spheres, disks and cylinders. along: as of curved_normal */
INLINE void round_coordinates(__global const float* record, INT at, INT flags, REAL3 position, REAL3 normal, REAL along,
                              REAL texture[2]) {
  const MASK sphere = (flags & PRIMITIVE_SPHERE) != 0, cylinder = (flags & PRIMITIVE_CYLINDER) != 0,
             disk = (flags & PRIMITIVE_DISK) != 0;
  if (!ANY(sphere | disk | cylinder)) return;
  record += PRIMITIVE_AT_FRAME;
  /* A sphere's axes are a, b, c, a cylinder's a, b; a disk's centre is a and its coordinates b . x and c . x. */
  const REAL3 a = gather3(record, at), b = gather3(record + 3, at), c = gather3(record + 6, at);
  const REAL3 from = sub3(position, a);
  const REAL x = SELECT(disk, dot3(from, b), dot3(normal, a)), y = SELECT(disk, dot3(from, c), dot3(normal, b));
  const REAL sign = SELECT((sphere | cylinder) & ((flags & PRIMITIVE_FLIPPED) != 0), -1.0f, 1.0f);
  REAL turn = atan2(y * sign, x * sign) * 0.15915494f;
  turn += SELECT(turn < 0.0f, 1.0f, 0.0f);
  const REAL polar = acos(clamp(dot3(normal, c) * sign, (REAL)(-1.0f), (REAL)(1.0f))) * 0.31830989f;
  texture[0] = SELECT(sphere | cylinder, turn, SELECT(disk, SQRT(x * x + y * y), texture[0]));
  texture[1] = SELECT(sphere, polar, SELECT(cylinder, along, SELECT(disk, turn, texture[1])));
}
#endif

/* Between the vertices' coordinates. */
INLINE void flat_coordinates(__global const float* record, INT at, REAL u, REAL v, REAL texture[2]) {
  record += PRIMITIVE_AT_UV;
  const REAL w = 1.0f - u - v;
  texture[0] = w * GATHER(record, at) + u * GATHER((record + 2), at) + v * GATHER((record + 4), at);
  texture[1] = w * GATHER((record + 1), at) + u * GATHER((record + 3), at) + v * GATHER((record + 5), at);
}
#endif

/* The direction in which the first texture coordinate grows, the second staying the same: dp/du, as in Mitsuba; of
 * any length, and not 0 but at a sphere's poles and a disk's centre. normal: geometric. */
INLINE REAL3 surface_tangent(__global const PrimitiveRecord* primitives, INT primitive, REAL3 position, REAL3 normal) {
  __global const float* record = (__global const float*)primitives;
  const INT at = primitive * (int)(sizeof(PrimitiveRecord) / sizeof(float));
  const Frame frame = make_frame(normal);
  const REAL3 flat =
      make3(GATHER((record + PRIMITIVE_AT_TANGENT), at), GATHER((record + PRIMITIVE_AT_TANGENT + 1), at), (REAL)(0.0f));
  REAL3 tangent = frame_to_world(&frame, flat);
#if HAS_ROUND
  const INT flags = GATHER_INT(((__global const int*)(record + PRIMITIVE_AT_FLAGS)), at);
  const MASK curved = (flags & PRIMITIVE_CURVED) != 0, disk = (flags & PRIMITIVE_DISK) != 0;
  if (ANY(curved)) { /* around the axis */
    const REAL3 axis = gather3(record + PRIMITIVE_AT_FRAME + 6, at);
    tangent = select3(curved, cross3(axis, normal), tangent);
  }
  if (ANY(disk)) /* away from the centre */
    tangent = select3(disk, sub3(position, gather3(record + PRIMITIVE_AT_FRAME, at)), tangent);
#endif
  return tangent;
}

/* texture: coordinates; where there are attributes of meshes u, v and the primitive; and where there are volumes the position. */
#if HAS_ATTRIBUTES
#define TEXTURE_AT_POSITION 5
#else
#define TEXTURE_AT_POSITION 2
#endif
#if HAS_VOLUME_TEXTURES
#define TEXTURE_PLACE (TEXTURE_AT_POSITION + 3)
#else
#define TEXTURE_PLACE TEXTURE_AT_POSITION
#endif

/* u, v: as trace() returned them. position is used for round primitives and volumes only. Definitions HAS_SMOOTH (some mesh has
 * vertex normals), HAS_ROUND (spheres, disks or cylinders) and HAS_TEXTURE leave out what a scene does not need. */
INLINE void surface_frame(__global const PrimitiveRecord* primitives, INT primitive, REAL u, REAL v, REAL3 position,
                          REAL3* normal, REAL3* shading, REAL texture[]) {
  __global const float* record = (__global const float*)primitives;
  const INT at = primitive * (int)(sizeof(PrimitiveRecord) / sizeof(float));
  const INT flags = GATHER_INT(((__global const int*)(record + PRIMITIVE_AT_FLAGS)), at);
  *normal = gather3(record, at);
#if HAS_ROUND
  const REAL along = curved_normal(record, at, flags, position, normal);
#endif
  *shading = *normal;
#if HAS_SMOOTH
  *shading = smooth_normal(record, at, flags, u, v, *normal);
#endif
  texture[0] = texture[1] = (REAL)(0.0f);
#if HAS_ATTRIBUTES
  texture[2] = u;
  texture[3] = v;
  texture[4] = AS_REAL(primitive);
#endif
#if HAS_VOLUME_TEXTURES
  texture[TEXTURE_AT_POSITION] = position.x;
  texture[TEXTURE_AT_POSITION + 1] = position.y;
  texture[TEXTURE_AT_POSITION + 2] = position.z;
#endif
#if HAS_TEXTURE
  flat_coordinates(record, at, u, v, texture);
#if HAS_ROUND
  round_coordinates(record, at, flags, position, *normal, along, texture);
#endif
#endif
}

#endif
