/* The media. MEDIUM(name, PREFIX, type): name.h beside this file declares PREFIX_NUMBERS and PREFIX_PARAMETERS
 * (shared/declaration.h); type: of the element in scene files. The first numbers are sigma_t and albedo, three channels
 * each, which scattering/medium.h knows; where a parameter has a grid of voxels, its number is times that field.
 *
 * f: CHANNELS values; n: the model's numbers.
 * distance: where there is a field, its integral along the flight.
 *   name_scattering(n, distance, f)    what a flight that ends in a scattering multiplies throughput by, density
 *                                      included
 *   name_passage(n, distance, f)       transmittance of a flight that reaches a surface, or of a connection
 * and for the host:
 *   name_numbers(parameters, n)        over any scalar: differentiated for the chain rule
 *   name_obstacle(parameters, slot)    why there is no derivative by parameters[slot]; empty: there is */
#ifndef ITN_MEDIUM_LIST_H
#define ITN_MEDIUM_LIST_H
#include "model/medium/by_scattering.h"
#include "model/medium/heterogeneous.h"
#include "model/medium/homogeneous.h"

#define MEDIUM_LIST(MEDIUM)                       \
  MEDIUM(homogeneous, HOMOGENEOUS, "homogeneous") \
  MEDIUM(heterogeneous, HETEROGENEOUS, "heterogeneous")

/* The same media by other parameters. MEDIUM_INPUT(name, PREFIX, medium, type): PREFIX_PARAMETERS, name_numbers and
 * name_obstacle stand for the medium's own. Scene files mean it where they give the first of these parameters. */
#define MEDIUM_INPUT_LIST(INPUT)                                                                          \
  INPUT(homogeneous_by_scattering, HOMOGENEOUS_BY_SCATTERING, homogeneous, "homogeneous")                 \
  INPUT(homogeneous_by_reduced_scattering, HOMOGENEOUS_BY_REDUCED_SCATTERING, homogeneous, "homogeneous") \
  INPUT(heterogeneous_by_scattering, HETEROGENEOUS_BY_SCATTERING, heterogeneous, "heterogeneous")         \
  INPUT(heterogeneous_by_reduced_scattering, HETEROGENEOUS_BY_REDUCED_SCATTERING, heterogeneous, "heterogeneous")

#endif
