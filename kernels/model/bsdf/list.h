/* The BSDFs. BSDF(name, PREFIX, type, variants): name.h beside this file declares PREFIX_NUMBERS, PREFIX_PARAMETERS,
 * PREFIX_TRAITS and PREFIX_RANDOM and has the functions below; type: of the element in scene files; variants: the values of its
 * parameter `distribution`, in the order of `variant`, or "".
 *
 * wi, wo: unit, leave the surface, in its frame (z: normal; x and y: any, but for BSDF_ANISOTROPIC). n: the model's numbers. f, weight: CHANNELS values.
 *   name_value(variant, n, wi, wo, f)                f |cos wo| [1/sr], for radiance: transmission holds 1 / eta^2
 *   name_density(variant, n, wi, wo)                 of name_draw [1/sr]; of both without what is chosen
 *   name_draw(variant, n, wi, u, wo, weight, pdf, inverse_eta)
 *                                                    wo from PREFIX_RANDOM uniform numbers u. weight: f |cos wo| / pdf
 *                                                    without 1 / eta^2, which is the square of inverse_eta, 1 where it
 *                                                    was reflected and nowhere else. pdf: 0 where wo was chosen, and its
 *                                                    weight is then over the probability of that choice
 *   name_chosen(variant, n, wi, wo, f)               BSDF_SMOOTH and BSDF_PARTLY_SMOOTH: the share of the light from the
 *                                                    chosen direction wo that goes to wi, without 1 / eta^2
 *   name_outcome(variant, n, wi, wo, reflected)      what was decided when wo was drawn: wo, or a microfacet's normal
 *   name_decision(variant, n, wi, outcome, reflected)  the density of that; lost samples count, so that it integrates to 1
 *   name_edge(variant, n, wi, wo)                    what log f lacks for its derivative, where f jumps; 0: nothing
 * and for the host:
 *   name_numbers(variant, parameters, n)             over any scalar: differentiated for the chain rule
 *   name_refusal(parameters)                         why such values cannot be rendered
 *   name_obstacle(parameters, slot)                  why there is no derivative by parameters[slot]; empty: there is */
#ifndef ITN_BSDF_LIST_H
#define ITN_BSDF_LIST_H
#include "model/bsdf/ashikhmin_shirley.h"
#include "model/bsdf/conductor.h"
#include "model/bsdf/dielectric.h"
#include "model/bsdf/diffuse.h"
#include "model/bsdf/merl.h"
#include "model/bsdf/oren_nayar.h"
#include "model/bsdf/plastic.h"
#include "model/bsdf/polarized_plastic.h"
#include "model/bsdf/polarizer.h"
#include "model/bsdf/principled.h"
#include "model/bsdf/principled_thin.h"
#include "model/bsdf/principled_transmission.h"
#include "model/bsdf/rough_conductor.h"
#include "model/bsdf/rough_conductor_anisotropic.h"
#include "model/bsdf/rough_dielectric.h"
#include "model/bsdf/rough_dielectric_anisotropic.h"
#include "model/bsdf/rough_plastic.h"
#include "model/bsdf/thin_dielectric.h"
#include "model/bsdf/ward.h"

#define BSDF_LIST(BSDF)                                                                               \
  BSDF(diffuse, DIFFUSE, "diffuse", "")                                                               \
  BSDF(dielectric, DIELECTRIC, "dielectric", "")                                                      \
  BSDF(rough_dielectric, ROUGH_DIELECTRIC, "roughdielectric", "beckmann ggx")                         \
  BSDF(rough_dielectric_anisotropic, ROUGH_DIELECTRIC_ANISOTROPIC, "roughdielectric", "beckmann ggx") \
  BSDF(rough_conductor, ROUGH_CONDUCTOR, "roughconductor", "beckmann ggx")                            \
  BSDF(rough_conductor_anisotropic, ROUGH_CONDUCTOR_ANISOTROPIC, "roughconductor", "beckmann ggx")    \
  BSDF(conductor, CONDUCTOR, "conductor", "")                                                         \
  BSDF(plastic, PLASTIC, "plastic", "")                                                               \
  BSDF(rough_plastic, ROUGH_PLASTIC, "roughplastic", "beckmann ggx")                                  \
  BSDF(polarized_plastic, POLARIZED_PLASTIC, "pplastic", "beckmann ggx")                              \
  BSDF(polarizer, POLARIZER, "polarizer", "")                                                         \
  BSDF(thin_dielectric, THIN_DIELECTRIC, "thindielectric", "")                                        \
  BSDF(principled, PRINCIPLED, "principled", "")                                                      \
  BSDF(principled_transmission, PRINCIPLED_TRANSMISSION, "principled", "")                            \
  BSDF(principled_thin, PRINCIPLED_THIN, "principledthin", "")                                        \
  BSDF(oren_nayar, OREN_NAYAR, "oren_nayar", "")                                                      \
  BSDF(ward, WARD, "ward", "")                                                                        \
  BSDF(ashikhmin_shirley, ASHIKHMIN_SHIRLEY, "ashikhmin_shirley", "")                                 \
  BSDF(merl, MERL, "merl", "")

#endif
