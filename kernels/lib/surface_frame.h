/* Geometric normal, shading normal and texture coordinates at a hit, from the primitive's record. */
#ifndef ITN_SURFACE_FRAME_H
#define ITN_SURFACE_FRAME_H
#include "lib/vector.h"
#include "shared/geometry_layout.h"

/* Where a path that goes on into `direction` starts: surely on its side of the surface, which the rounded position on the
 * surface is not (lib/trace.h). */
inline REAL3 beside_surface(__global const PrimitiveRecord* primitives, INT primitive, REAL3 position, REAL3 normal,
                            REAL3 direction) {
  __global const float* record = (__global const float*)primitives;
  const REAL offset =
      GATHER((record + PRIMITIVE_AT_OFFSET), primitive * (int)(sizeof(PrimitiveRecord) / sizeof(float)));
  return add3(position, scale3(normal, SELECT(dot3(normal, direction) > 0.0f, offset, -offset)));
}

/* u, v: as trace() returned them. position is used for round primitives only. Definitions HAS_SMOOTH (some mesh has vertex
 * normals), HAS_ROUND (spheres, disks or cylinders) and HAS_TEXTURE leave out what a scene does not need. */
inline void surface_frame(__global const PrimitiveRecord* primitives, INT primitive, REAL u, REAL v, REAL3 position,
                          REAL3* normal, REAL3* shading, REAL texture[2]) {
  __global const float* record = (__global const float*)primitives;
  INT at = primitive * (int)(sizeof(PrimitiveRecord) / sizeof(float));
  *normal = make3(GATHER(record, at), GATHER((record + 1), at), GATHER((record + 2), at));
  INT flags = GATHER_INT(((__global const int*)(record + PRIMITIVE_AT_FLAGS)), at);
#if HAS_ROUND
  MASK sphere = (flags & PRIMITIVE_SPHERE) != 0;
  if (ANY(sphere)) {
    REAL3 out = sub3(position, *normal); /* the record holds the centre */
    REAL inverse = SELECT((flags & PRIMITIVE_FLIPPED) != 0, -1.0f, 1.0f) / SQRT(dot3(out, out));
    normal->x = SELECT(sphere, out.x * inverse, normal->x);
    normal->y = SELECT(sphere, out.y * inverse, normal->y);
    normal->z = SELECT(sphere, out.z * inverse, normal->z);
  }
#endif
#if HAS_ROUND
  const MASK cylinder = (flags & PRIMITIVE_CYLINDER) != 0;
  REAL along = (REAL)(0.0f); /* the axis, in its lengths */
  if (ANY(cylinder)) {
    const REAL3 from = sub3(position, *normal); /* the record holds the middle of the first circle */
    const REAL3 dual = make3(GATHER((record + 18), at), GATHER((record + 19), at), GATHER((record + 20), at));
    along = dot3(from, dual);
    const REAL3 out = sub3(from, scale3(dual, along / dot3(dual, dual)));
    const REAL inverse = SELECT((flags & PRIMITIVE_FLIPPED) != 0, -1.0f, 1.0f) / SQRT(dot3(out, out));
    normal->x = SELECT(cylinder, out.x * inverse, normal->x);
    normal->y = SELECT(cylinder, out.y * inverse, normal->y);
    normal->z = SELECT(cylinder, out.z * inverse, normal->z);
  }
#endif
  *shading = *normal;
#if HAS_SMOOTH
  MASK smooth = (flags & PRIMITIVE_SMOOTH) != 0;
  if (ANY(smooth)) {
    REAL w = 1.0f - u - v;
    REAL3 n;
    n.x = w * GATHER((record + 12), at) + u * GATHER((record + 15), at) + v * GATHER((record + 18), at);
    n.y = w * GATHER((record + 13), at) + u * GATHER((record + 16), at) + v * GATHER((record + 19), at);
    n.z = w * GATHER((record + 14), at) + u * GATHER((record + 17), at) + v * GATHER((record + 20), at);
    REAL length2 = dot3(n, n);
    smooth = smooth & (length2 > 0.0f);
    REAL inverse = 1.0f / SQRT(length2);
    shading->x = SELECT(smooth, n.x * inverse, normal->x);
    shading->y = SELECT(smooth, n.y * inverse, normal->y);
    shading->z = SELECT(smooth, n.z * inverse, normal->z);
  }
#endif
#if HAS_TEXTURE
  REAL w0 = 1.0f - u - v;
  texture[0] = w0 * GATHER((record + 4), at) + u * GATHER((record + 6), at) + v * GATHER((record + 8), at);
  texture[1] = w0 * GATHER((record + 5), at) + u * GATHER((record + 7), at) + v * GATHER((record + 9), at);
#if HAS_ROUND
  MASK disk = (flags & PRIMITIVE_DISK) != 0, analytic = sphere | disk | cylinder;
  if (ANY(analytic)) {
    REAL3 a, b, c;
    a.x = GATHER((record + 12), at);
    a.y = GATHER((record + 13), at);
    a.z = GATHER((record + 14), at);
    b.x = GATHER((record + 15), at);
    b.y = GATHER((record + 16), at);
    b.z = GATHER((record + 17), at);
    c.x = GATHER((record + 18), at);
    c.y = GATHER((record + 19), at);
    c.z = GATHER((record + 20), at);
    /* A sphere's axes are a, b, c, a cylinder's a, b; a disk's centre is a and its coordinates b . x and c . x. */
    REAL3 from = sub3(position, a);
    REAL x = SELECT(disk, dot3(from, b), dot3(*normal, a)), y = SELECT(disk, dot3(from, c), dot3(*normal, b));
    REAL sign = SELECT((sphere | cylinder) & ((flags & PRIMITIVE_FLIPPED) != 0), -1.0f, 1.0f);
    REAL turn = atan2(y * sign, x * sign) * 0.15915494f;
    turn += SELECT(turn < 0.0f, 1.0f, 0.0f);
    REAL polar = acos(clamp(dot3(*normal, c) * sign, (REAL)(-1.0f), (REAL)(1.0f))) * 0.31830989f;
    texture[0] = SELECT(sphere | cylinder, turn, SELECT(disk, SQRT(x * x + y * y), texture[0]));
    texture[1] = SELECT(sphere, polar, SELECT(cylinder, along, SELECT(disk, turn, texture[1])));
  }
#endif
#else
  texture[0] = texture[1] = (REAL)(0.0f);
#endif
}

#endif
