/* The lights that have a place in the scene; light around it is in light/environment.h. LIGHT(name, PREFIX, type): name.h beside
 * this file declares PREFIX_NUMBERS and PREFIX_PARAMETERS (shared/declaration.h), PREFIX_TRAITS, and has the functions below;
 * type: of the element in scene files.
 *
 * The first three numbers are the light's colour, in which what arrives is linear. n: the model's numbers.
 *   name_arrives(n, from, on, normal, towards, distance, share, uv)
 *       what reaches the point `from`. towards: unit, to the light; distance [scene unit], FAR_AWAY: from infinity; share:
 *       times the colour it is radiance [1] where LIGHT_ON_SHAPE, else irradiance at right angles. on, normal: a point of
 *       the light's surface, where LIGHT_ON_SHAPE; uv: where LIGHT_TINTED, the place in the picture that multiplies the
 *       share, which the three numbers behind the colour are or stand for; of a shape, the texture coordinates of `on`, which
 *       are there already
 * and for the host:
 *   name_numbers(parameters, n)        over any scalar: differentiated for the chain rule
 *   name_obstacle(parameters, slot)    why there is no derivative by parameters[slot]; empty: there is */
#ifndef ITN_LIGHT_LIST_H
#define ITN_LIGHT_LIST_H
#include "model/light/area.h"
#include "model/light/directional.h"
#include "model/light/directional_area.h"
#include "model/light/point.h"
#include "model/light/projector.h"
#include "model/light/spot.h"
#include "model/light/textured_area.h"

#define LIGHT_LIST(LIGHT)                                      \
  LIGHT(point, POINT, "point")                                 \
  LIGHT(spot, SPOT, "spot")                                    \
  LIGHT(directional, DIRECTIONAL, "directional")               \
  LIGHT(directional_area, DIRECTIONAL_AREA, "directionalarea") \
  LIGHT(projector, PROJECTOR, "projector")                     \
  LIGHT(area, AREA, "area")                                    \
  LIGHT(textured_area, TEXTURED_AREA, "area")

#endif
