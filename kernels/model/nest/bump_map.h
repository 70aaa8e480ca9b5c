/* Mitsuba's `bumpmap`: the surface as if it were displaced along its normal by `scale` times a texture. The number of the
 * texture is, where a path has arrived, the bent normal, of any length, in the surface's frame (lib/bump.h): how the height
 * grows along the texture's coordinates depends on how these lie on the surface. */
#ifndef ITN_NEST_BUMP_MAP_H
#define ITN_NEST_BUMP_MAP_H
#include "model/nest/bent_normal.h"
#include "model/obstacle.h"

#define BUMP_MAP_NUMBERS(NUMBER)                                           \
  NUMBER(BUMP_MAP, texture, 3, ROLE_BUMP, COORDINATE_ITSELF)               \
  NUMBER(BUMP_MAP, scale, 1, ROLE_FIXED, COORDINATE_ITSELF)                \
  NUMBER(BUMP_MAP, flip_invalid_normals, 1, ROLE_FIXED, COORDINATE_ITSELF) \
  NUMBER(BUMP_MAP, use_shadowing_function, 1, ROLE_FIXED, COORDINATE_ITSELF)
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

#ifndef __OPENCL_VERSION__
MODEL_VOID bump_map_numbers(const REAL* parameters, REAL* n) {
  for (int k = 0; k < 6; ++k) n[k] = parameters[k];
}
inline const char* bump_map_obstacle(const double*, int) {
  return "heights move normals, by which nothing is differentiated";
}
#endif

#endif
