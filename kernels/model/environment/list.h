/* The light that surrounds a scene. ENVIRONMENT(name, PREFIX, type): name.h beside this file declares PREFIX_PARAMETERS
 * (shared/declaration.h), PREFIX_TRAITS and PREFIX_FORMULA, and has the functions below; type: of the element in scene files.
 *
 *   PREFIX_FORMULA    the function of program/scores.h that name_derivative calls; "": it needs none
 *
 * d: unit, in the light's own frame (to_world), towards the light. record: what runtime/render/compile/environment/name.cpp has
 * filled; tables: all records' numbers without end.
 *   name_radiance(record, tables, d, rgb)        of what is smooth; the sun is in light/sun.h
 *   name_derivative(record, moving, tables, d, rgb)
 *                                                of that, by the parameter for which `moving` was filled
 *   name_pdf(record, tables, d)                  of name_sample [1/sr]
 *   name_sample(record, tables, u0, u1, pdf)     d, drawn in proportion to it from two uniform numbers */
#ifndef ITN_ENVIRONMENT_LIST_H
#define ITN_ENVIRONMENT_LIST_H
#include "model/environment/constant.h"
#include "model/environment/envmap.h"
#include "model/environment/spherical_harmonics.h"
#include "model/environment/sunsky.h"

#define ENVIRONMENT_LIST(ENVIRONMENT)         \
  ENVIRONMENT(constant, CONSTANT, "constant") \
  ENVIRONMENT(envmap, ENVMAP, "envmap")       \
  ENVIRONMENT(sunsky, SUNSKY, "sunsky")       \
  ENVIRONMENT(spherical_harmonics, SPHERICAL_HARMONICS, "sphericalharmonics")

#endif
