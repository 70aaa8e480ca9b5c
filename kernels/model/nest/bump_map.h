/* Mitsuba's `bumpmap`: the surface as if it were displaced along its normal by `scale` times a texture. The number of the
 * texture is, where a path has arrived, the bent normal, of any length, in the surface's frame (scattering/bump.h): how the height
 * grows along the texture's coordinates depends on how these lie on the surface. Scores by it are by the two slopes of the
 * heights, in its first two slots: along_u and along_v, which are filled in where a path has arrived too, say how the bent
 * normal moves with them. */
#ifndef ITN_NEST_BUMP_MAP_H
#define ITN_NEST_BUMP_MAP_H
#include "model/nest/bent_normal.h"
#include "model/obstacle.h"

#define BUMP_MAP_NUMBERS(NUMBER)                                             \
  NUMBER(BUMP_MAP, texture, 3, ROLE_BUMP, COORDINATE_ITSELF)                 \
  NUMBER(BUMP_MAP, scale, 1, ROLE_FIXED, COORDINATE_ITSELF)                  \
  NUMBER(BUMP_MAP, flip_invalid_normals, 1, ROLE_FIXED, COORDINATE_ITSELF)   \
  NUMBER(BUMP_MAP, use_shadowing_function, 1, ROLE_FIXED, COORDINATE_ITSELF) \
  NUMBER(BUMP_MAP, along_u, 3, ROLE_NORMAL, COORDINATE_ITSELF)               \
  NUMBER(BUMP_MAP, along_v, 3, ROLE_NORMAL, COORDINATE_ITSELF)
#define BUMP_MAP_PARAMETERS(PARAMETER)         \
  PARAMETER(texture, BUMP_TEXTURE, 0, "")      \
  PARAMETER(scale, BUMP_SCALE, 1, "")          \
  PARAMETER(flip_invalid_normals, FLAG, 1, "") \
  PARAMETER(use_shadowing_function, FLAG, 1, "")
#define BUMP_MAP_TRAITS (BSDF_ANISOTROPIC | BSDF_BUMPED)
enum { BUMP_MAP_NUMBERS(DECLARE_SLOT) BUMP_MAP_SLOTS };

MODEL_VOID bump_map_enter(int branch, const REAL* n, REAL3 wi, REAL3 wo, NEST* x) {
  bend_normal(make3(n[BUMP_MAP_texture], n[BUMP_MAP_texture + 1], n[BUMP_MAP_texture + 2]),
              n[BUMP_MAP_flip_invalid_normals], n[BUMP_MAP_use_shadowing_function], wi, wo, x);
}

/* One of the surface's tangents with a height that grows by `slope` along it; unit. */
MODEL3 bumped_tangent(REAL3 axis, REAL slope, REAL3 n) {
  REAL3 along = add3(axis, scale3(n, slope - dot3(n, axis)));
  return scale3(along, NUMBER(1) / SQRT(MAX(dot3(along, along), NUMBER(1e-30))));
}

/* The bent normal, of any length, on the geometric normal's side. u, v: dp/du and dp/dv; n: the shading normal; slope_u,
 * slope_v: d height / d u and d height / d v. */
MODEL3 bumped_normal(REAL3 u, REAL3 v, REAL3 n, REAL3 normal, REAL slope_u, REAL slope_v) {
  REAL3 bent = cross3(bumped_tangent(u, slope_u, n), bumped_tangent(v, slope_v, n));
  return scale3(bent, SELECT(dot3(bent, normal) < NUMBER(0), NUMBER(-1), NUMBER(1)));
}

#ifndef __OPENCL_VERSION__
MODEL_VOID bump_map_numbers(const REAL* parameters, REAL* n) {
  for (int k = 0; k < 6; ++k) n[k] = parameters[k];
  for (int k = 6; k < 12; ++k) n[k] = NUMBER(0);
}
inline const char* bump_map_obstacle(const double*, int slot) {
  return slot == 0 ? differentiable : "a factor of heights, by which nothing is differentiated; take the heights";
}
#endif

#endif
