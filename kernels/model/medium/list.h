/* The media. MEDIUM(name, PREFIX, type): name.h beside this file declares PREFIX_NUMBERS and PREFIX_PARAMETERS
 * (shared/declaration.h); type: of the element in scene files. The first numbers are sigma_t and albedo, three channels
 * each, which lib/medium.h knows; where a parameter has a grid of voxels, its number is times that field.
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
#include "model/medium/heterogeneous.h"
#include "model/medium/homogeneous.h"

#define MEDIUM_LIST(MEDIUM)                       \
  MEDIUM(homogeneous, HOMOGENEOUS, "homogeneous") \
  MEDIUM(heterogeneous, HETEROGENEOUS, "heterogeneous")

#endif
