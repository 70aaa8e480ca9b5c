/* What is known of surface points, over WIDTH lanes. */
#ifndef ITN_SURFACE_H
#define ITN_SURFACE_H
#include "lib/vector.h"
#include "shared/geometry_layout.h"

typedef struct {
  REAL3 normal;    /* unit, outward, of the flat triangle */
  REAL3 shading;   /* unit, interpolated from the vertices' where the mesh has them */
  REAL u, v;       /* texture coordinates, as in Mitsuba */
  REAL offset;     /* for beside_surface */
  INT shape;
} SurfacePoint;

/* Where a path that goes on into `direction` starts: surely on its side of the surface, which the rounded position on the
 * surface is not. For flights and trace(). */
inline REAL3 beside_surface(REAL3 position, REAL3 normal, REAL offset, REAL3 direction) {
  return add3(position, scale3(normal, SELECT(dot3(normal, direction) > NUMBER(0), offset, -offset)));
}

inline REAL3 select3(MASK mask, REAL3 yes, REAL3 no) {
  return make3(SELECT(mask, yes.x, no.x), SELECT(mask, yes.y, no.y), SELECT(mask, yes.z, no.z));
}

inline REAL3 normalized_or(REAL3 a, REAL3 otherwise) {
  const REAL square = dot3(a, a);
  const MASK usable = square > NUMBER(1e-30f);
  const REAL s = SELECT(usable, rsqrt(square), NUMBER(0));
  return select3(usable, scale3(a, s), otherwise);
}

/* hit_u, hit_v, position as in Hit. Lanes without a surface: pass any valid primitive. */
inline SurfacePoint surface_point(__global const PrimitiveRecord* primitives, INT primitive, REAL hit_u, REAL hit_v,
                                  REAL3 position) {
  __global const float* p = (__global const float*)primitives;
  __global const int* integers = (__global const int*)primitives;
  const INT at = primitive * (INT)(sizeof(PrimitiveRecord) / sizeof(float));
#define FIELD(index) GATHER(p, at + (index))
  SurfacePoint s;
  const INT flags = GATHER_INT(integers, at + PRIMITIVE_AT_FLAGS);
  s.shape = GATHER_INT(integers, at + PRIMITIVE_AT_SHAPE);
  s.offset = FIELD(PRIMITIVE_AT_OFFSET);
  const REAL3 stored = make3(FIELD(0), FIELD(1), FIELD(2));
  const REAL w = NUMBER(1) - hit_u - hit_v;
  const REAL u0 = FIELD(PRIMITIVE_AT_UV), v0 = FIELD(PRIMITIVE_AT_UV + 1);
  s.u = w * u0 + hit_u * FIELD(PRIMITIVE_AT_UV + 2) + hit_v * FIELD(PRIMITIVE_AT_UV + 4);
  s.v = w * v0 + hit_u * FIELD(PRIMITIVE_AT_UV + 3) + hit_v * FIELD(PRIMITIVE_AT_UV + 5);
  s.normal = stored;
  s.shading = stored;
  if (ANY((flags & (PRIMITIVE_SMOOTH | PRIMITIVE_SPHERE | PRIMITIVE_DISK)) != 0)) {
    const int f = PRIMITIVE_AT_FRAME;
    const REAL3 a = make3(FIELD(f), FIELD(f + 1), FIELD(f + 2)), b = make3(FIELD(f + 3), FIELD(f + 4), FIELD(f + 5)),
                c = make3(FIELD(f + 6), FIELD(f + 7), FIELD(f + 8));
    const MASK smooth = (flags & PRIMITIVE_SMOOTH) != 0;
    const REAL3 between = normalized_or(add3(add3(scale3(a, w), scale3(b, hit_u)), scale3(c, hit_v)), stored);
    s.shading = select3(smooth, between, stored);
    const MASK sphere = (flags & PRIMITIVE_SPHERE) != 0;
    if (ANY(sphere)) {
      const REAL3 out = normalized_or(sub3(position, stored), make3(NUMBER(0), NUMBER(0), NUMBER(1)));
      const REAL x = dot3(out, a), y = dot3(out, b), z = dot3(out, c);
      const REAL phi = atan2(y, x) * NUMBER(0.5 / PI_);
      s.u = SELECT(sphere, SELECT(phi < NUMBER(0), phi + NUMBER(1), phi), s.u);
      s.v = SELECT(sphere, acos(clamp(z, NUMBER(-1), NUMBER(1))) * NUMBER(1 / PI_), s.v);
      const REAL sign = SELECT((flags & PRIMITIVE_FLIPPED) != 0, NUMBER(-1), NUMBER(1));
      s.normal = select3(sphere, scale3(out, sign), s.normal);
      s.shading = select3(sphere, s.normal, s.shading);
    }
    const MASK disk = (flags & PRIMITIVE_DISK) != 0;
    if (ANY(disk)) {
      const REAL3 from = sub3(position, a);
      const REAL x = dot3(from, b), y = dot3(from, c);
      const REAL phi = atan2(y, x) * NUMBER(0.5 / PI_);
      s.u = SELECT(disk, SQRT(x * x + y * y), s.u);
      s.v = SELECT(disk, SELECT(phi < NUMBER(0), phi + NUMBER(1), phi), s.v);
    }
  }
#undef FIELD
  return s;
}

#endif
