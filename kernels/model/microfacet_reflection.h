/* Reflection at microfacets, but for the reflectance of a facet: what rough metals and rough coatings share.
 *
 *   density of a mirror image at a visible normal  D(h) G1(wi) / (4 wi.z) [1/sr],  h ~ wi + wo
 *
 * 0 unless both directions are above the surface. wi, wo: unit, leave the surface, in its frame. D and G1:
 * microfacet.h.
 *   Walter, Marschner, Li, Torrance 2007, "Microfacet models for refraction through rough surfaces"
 * Tests: tests/model/bsdfs_test.cpp, through the BSDFs that have it */
#ifndef ITN_MICROFACET_REFLECTION_H
#define ITN_MICROFACET_REFLECTION_H
#include "model/microfacet.h"

MODEL3 reflection_half(REAL3 wi, REAL3 wo) {
  REAL3 sum = add3(wi, wo);
  return scale3(sum, NUMBER(1) / SQRT(MAX(dot3(sum, sum), NUMBER(1e-20))));
}

MODEL reflection_density(int distribution, REAL alpha, REAL3 wi, REAL3 wo) {
  REAL3 h = reflection_half(wi, wo);
  MASK possible = (wi.z > NUMBER(0)) & (wo.z > NUMBER(0));
  REAL density = microfacet_normals(distribution, h, alpha) * microfacet_shadowing(distribution, wi, alpha) /
                 (NUMBER(4) * MAX(wi.z, NUMBER(1e-9)));
  return SELECT(possible, density, NUMBER(0));
}

/* Cosine of incidence at the facet that mirrors wo to wi. */
MODEL reflection_cosine(REAL3 wi, REAL3 wo) { return MIN(ABS(dot3(wi, reflection_half(wi, wo))), NUMBER(1)); }

/* The mirror image of wi at a visible normal, which may be below the surface; *cosine: of incidence there. */
MODEL3 reflection_sample(int distribution, REAL alpha, REAL3 wi, REAL u1, REAL u2, REAL* cosine) {
  REAL3 up = make3(wi.x, wi.y, MAX(wi.z, NUMBER(1e-9)));
  REAL3 m = microfacet_visible_sample(distribution, up, alpha, u1, u2);
  *cosine = dot3(wi, m);
  return sub3(scale3(m, NUMBER(2) * *cosine), wi);
}

#endif
