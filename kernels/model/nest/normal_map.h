/* Mitsuba's `normalmap`: normals are the colours of a texture, of the frame whose x axis follows the first texture coordinate:
 * normal = 2 colour - 1, of any length. */
#ifndef ITN_NEST_NORMAL_MAP_H
#define ITN_NEST_NORMAL_MAP_H
#include "model/nest/bent_normal.h"
#include "model/obstacle.h"

#define NORMAL_MAP_NUMBERS(NUMBER)                                           \
  NUMBER(NORMAL_MAP, normalmap, 3, ROLE_NORMAL, COORDINATE_ITSELF)           \
  NUMBER(NORMAL_MAP, flip_invalid_normals, 1, ROLE_FIXED, COORDINATE_ITSELF) \
  NUMBER(NORMAL_MAP, use_shadowing_function, 1, ROLE_FIXED, COORDINATE_ITSELF)
#define NORMAL_MAP_PARAMETERS(PARAMETER)       \
  PARAMETER(normalmap, NORMAL_TEXTURE, -1, "") \
  PARAMETER(flip_invalid_normals, FLAG, 1, "") \
  PARAMETER(use_shadowing_function, FLAG, 1, "")
#define NORMAL_MAP_TRAITS BSDF_ANISOTROPIC
enum { NORMAL_MAP_NUMBERS(DECLARE_SLOT) NORMAL_MAP_SLOTS };

MODEL_VOID normal_map_enter(int branch, const REAL* n, REAL3 wi, REAL3 wo, NEST* x) {
  REAL3 colour = make3(n[NORMAL_MAP_normalmap], n[NORMAL_MAP_normalmap + 1], n[NORMAL_MAP_normalmap + 2]);
  REAL3 normal =
      make3(NUMBER(2) * colour.x - NUMBER(1), NUMBER(2) * colour.y - NUMBER(1), NUMBER(2) * colour.z - NUMBER(1));
  bend_normal(normal, n[NORMAL_MAP_flip_invalid_normals], n[NORMAL_MAP_use_shadowing_function], wi, wo, x);
}

#ifndef __OPENCL_VERSION__
MODEL_VOID normal_map_numbers(const REAL* parameters, REAL* n) {
  for (int k = 0; k < 5; ++k) n[k] = parameters[k];
}
inline const char* normal_map_obstacle(const double*, int) { return differentiable; }
#endif

#endif
