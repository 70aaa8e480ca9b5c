/* Points of shapes: of those that shine, and of those on which a sensor lies. */
#ifndef ITN_SURFACE_POINT_H
#define ITN_SURFACE_POINT_H
#include "shared/vector.h"
#include "shared/light_layout.h"

INLINE REAL3 gather_vector(__global const float* from, INT at) {
  return make3(GATHER(from, at), GATHER((from + 1), at), GATHER((from + 2), at));
}

/* The beginning of the row of one of each lane's surfaces, chosen by area; 0 where the lane has none. */
INLINE INT choose_surface(__global const float* tables, INT first, INT count, REAL choice) {
  Lanes surfaces, table, u, row;
  surfaces.integer = count;
  table.integer = first;
  u.real = choice;
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) {
    int low = 0, high = max(surfaces.i[l] - 1, 0); /* the last whose share begins at or before u */
    while (low < high) {
      const int middle = (low + high + 1) / 2;
      if (tables[table.i[l] + middle] <= u.f[l])
        low = middle;
      else
        high = middle - 1;
    }
    row.i[l] = surfaces.i[l] == 0 ? 0 : table.i[l] + surfaces.i[l] + 1 + low * LIGHT_SURFACE_SIZE;
  }
  return row.integer;
}

/* A point of each lane's surface, uniform over its area, and the normal of its front there. */
INLINE void point_of_surface(__global const float* tables, INT row, REAL u0, REAL u1, REAL3* on, REAL3* normal) {
  const REAL3 place = gather_vector(tables + LIGHT_SURFACE_PLACE, row);
  const REAL3 du = gather_vector(tables + LIGHT_SURFACE_U, row);
  const REAL3 dv = gather_vector(tables + LIGHT_SURFACE_V, row);
  const REAL3 dw = gather_vector(tables + LIGHT_SURFACE_W, row);
  REAL sine, cosine, root = SQRT(u0);
  sin_cos_2pi(u1, &sine, &cosine);
  REAL s = 1.0f - root, t = u1 * root;
  REAL3 offset = add3(scale3(du, s), scale3(dv, t));
  *normal = dw;
#if HAS_ROUND
  const INT kind = CAST_INT(GATHER((tables + LIGHT_SURFACE_KIND), row));
  const REAL side = GATHER((tables + LIGHT_SURFACE_SIDE), row), radius = SQRT(dot3(du, du));
  const REAL3 across = add3(scale3(du, cosine), scale3(dv, sine)), around = uniform_sphere(u0, u1);
  offset = select3(kind == LIGHT_DISK, scale3(across, root), offset);
  offset = select3(kind == LIGHT_CYLINDER, add3(across, scale3(dw, u0)), offset);
  offset = select3(kind == LIGHT_SPHERE, scale3(around, radius), offset);
  *normal = select3(kind == LIGHT_CYLINDER, scale3(across, side / radius), *normal);
  *normal = select3(kind == LIGHT_SPHERE, scale3(around, side), *normal);
#endif
  /* connections end in front of the surface, and do not meet it */
  *on = add3(add3(place, offset), scale3(*normal, GATHER((tables + LIGHT_SURFACE_OFFSET), row)));
}

/* A point of each lane's shape, uniform over its area, and the normal of its front there; anything where it has no surfaces. */
INLINE void sample_surface(__global const float* tables, INT first, INT count, REAL u0, REAL u1, REAL u2, REAL3* on,
                           REAL3* normal) {
  point_of_surface(tables, choose_surface(tables, first, count, u2), u0, u1, on, normal);
}

#endif
