/* The list of nests that may stand around BSDFs. NEST(name, PREFIX, type): name.h beside this file declares
 * PREFIX_NUMBERS, PREFIX_PARAMETERS and PREFIX_TRAITS, which its structures have too, and has the functions below;
 * type: of the element in scene files.
 *
 *   name_enter(branch, n, wi, wo, x)     from outside towards the leaf: x (nest.h) as it is inside, in one of its branches.
 *                                        n: its numbers; wi, wo: in the surface's frame
 * and for the host:
 *   name_numbers(parameters, n)          over any scalar: differentiated for the chain rule
 *   name_obstacle(parameters, slot)      why there is no derivative by parameters[slot]; empty: there is */
#ifndef ITN_NEST_LIST_H
#define ITN_NEST_LIST_H
#include "model/nest/blend.h"
#include "model/nest/bump_map.h"
#include "model/nest/dictionary.h"
#include "model/nest/opacity_mask.h"
#include "model/nest/normal_map.h"
#include "model/nest/passage.h"
#include "model/nest/twosided.h"

#define NEST_LIST(NEST_)                      \
  NEST_(blend, BLEND, "blendbsdf")            \
  NEST_(dictionary, DICTIONARY, "dictionary") \
  NEST_(opacity_mask, OPACITY_MASK, "mask")   \
  NEST_(twosided, TWOSIDED, "twosided")       \
  NEST_(normal_map, NORMAL_MAP, "normalmap")  \
  NEST_(bump_map, BUMP_MAP, "bumpmap")

#endif
