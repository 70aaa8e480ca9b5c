/* Smooth interface between two dielectrics: mirror reflection and Snell refraction.
 *
 * wi, wo: unit, leave the surface, in its frame (z: normal); wi on either side. eta > 0: refractive index of the side
 * opposite to wi over that of wi's side. Agrees with Mitsuba 3's "dielectric" for radiance.
 * Tests: tests/model/dielectric_test.cpp */
#ifndef ITN_DIELECTRIC_H
#define ITN_DIELECTRIC_H
#include "model/fresnel_dielectric.h"

/* Reflection if u < F, else transmission. *weight: 1, over eta^2 for transmission (radiance changes between media). */
MODEL_VOID dielectric_sample(REAL eta, REAL3 wi, REAL u, REAL3* wo, REAL* weight, MASK* reflected) {
  REAL f, cos_t;
  fresnel_dielectric_refract(ABS(wi.z), eta, &f, &cos_t);
  MASK mirror = u < f;
  REAL scale = SELECT(mirror, NUMBER(1), NUMBER(1) / eta);
  *wo = make3(-wi.x * scale, -wi.y * scale, SELECT(mirror, wi.z, SELECT(wi.z < NUMBER(0), cos_t, -cos_t)));
  *weight = scale * scale;
  *reflected = mirror;
}

#endif
