/* The phase functions. PHASE(name, PREFIX, type): name.h beside this file declares PREFIX_NUMBERS and PREFIX_PARAMETERS
 * (shared/declaration.h) and has the functions below; type: of the element in scene files.
 *
 * cosine: between the directions of travel before and after the scattering, 1: straight on. n: the model's numbers.
 *   name_value(n, cosine)              [1/sr], integrates to 1 over the sphere
 *   name_draw(n, u, cosine, sine)      exactly in proportion to it, from a uniform number
 *   name_mean_cosine(n)
 * and for the host:
 *   name_numbers(parameters, n)        over any scalar: differentiated for the chain rule
 *   name_obstacle(parameters, slot)    why there is no derivative by parameters[slot]; empty: there is
 *
 * Two are not in the list, whose numbers differ from scene to scene: a table of values (tabulated.h), and a mixture of any
 * of all these (mixture.h). */
#ifndef ITN_PHASE_LIST_H
#define ITN_PHASE_LIST_H
#include "model/phase/draine.h"
#include "model/phase/henyey_greenstein.h"
#include "model/phase/isotropic.h"
#include "model/phase/mixture.h"
#include "model/phase/rayleigh.h"
#include "model/phase/tabulated.h"
#include "model/phase/vmf.h"

#define PHASE_LIST(PHASE)                           \
  PHASE(isotropic, ISOTROPIC, "isotropic")          \
  PHASE(henyey_greenstein, HENYEY_GREENSTEIN, "hg") \
  PHASE(vmf, VMF, "vmf")                            \
  PHASE(rayleigh, RAYLEIGH, "rayleigh")             \
  PHASE(draine, DRAINE, "draine")

#endif
