/* Microfacets whose roughness differs along the two axes of the surface: those of microfacet.h, stretched.
 *
 *   slopes along x are alpha_u / alpha_v =: s times those of a surface of roughness alpha_v, so that
 *   D(m)  = D(m.x / s, m.y, m.z; alpha_v) / s      [1/sr]
 *   G1(v) = G1(s v.x, v.y, v.z; alpha_v)           [1]
 *
 * where the formulas on the right take vectors of any length, as those of microfacet.h do. alpha_u along x, alpha_v along
 * y, both > 0. Everything else, and the fit of Beckmann's G1, as there.
 *   Heitz 2014, "Understanding the masking-shadowing function in microfacet-based BRDFs"
 * Tests: tests/model/bsdfs_test.cpp, through the BSDFs that have it */
#ifndef ITN_MICROFACET_ANISOTROPIC_H
#define ITN_MICROFACET_ANISOTROPIC_H
#include "model/microfacet_reflection.h"

MODEL3 along_x(REAL3 v, REAL factor) { return make3(v.x * factor, v.y, v.z); }

MODEL anisotropic_normals(int distribution, REAL3 m, REAL alpha_u, REAL alpha_v) {
  REAL shrink = alpha_v / alpha_u;
  return microfacet_normals(distribution, along_x(m, shrink), alpha_v) * shrink;
}

MODEL anisotropic_shadowing(int distribution, REAL3 v, REAL alpha_u, REAL alpha_v) {
  return microfacet_shadowing(distribution, along_x(v, alpha_u / alpha_v), alpha_v);
}

/* A visible normal; wi.z > 0. */
MODEL3 anisotropic_visible_sample(int distribution, REAL3 wi, REAL alpha_u, REAL alpha_v, REAL u1, REAL u2) {
  REAL stretch = alpha_u / alpha_v;
  REAL3 m = along_x(microfacet_visible_sample(distribution, along_x(wi, stretch), alpha_v, u1, u2), stretch);
  return scale3(m, NUMBER(1) / SQRT(dot3(m, m)));
}

/* Density of the normals that anisotropic_visible_sample draws, as microfacet_visible_density. */
MODEL anisotropic_visible_density(int distribution, REAL3 wi, REAL3 m, REAL alpha_u, REAL alpha_v) {
  REAL shrink = alpha_v / alpha_u;
  return microfacet_visible_density(distribution, along_x(wi, alpha_u / alpha_v), along_x(m, shrink), alpha_v) * shrink;
}

/* As reflection_density and reflection_sample of microfacet_reflection.h. */
MODEL anisotropic_reflection_density(int distribution, REAL alpha_u, REAL alpha_v, REAL3 wi, REAL3 wo) {
  REAL3 h = reflection_half(wi, wo);
  MASK possible = (wi.z > NUMBER(0)) & (wo.z > NUMBER(0));
  REAL density = anisotropic_normals(distribution, h, alpha_u, alpha_v) *
                 anisotropic_shadowing(distribution, wi, alpha_u, alpha_v) / (NUMBER(4) * MAX(wi.z, NUMBER(1e-9)));
  return SELECT(possible, density, NUMBER(0));
}

MODEL3 anisotropic_reflection_sample(int distribution, REAL alpha_u, REAL alpha_v, REAL3 wi, REAL u1, REAL u2,
                                     REAL* cosine) {
  REAL3 up = make3(wi.x, wi.y, MAX(wi.z, NUMBER(1e-9)));
  REAL3 m = anisotropic_visible_sample(distribution, up, alpha_u, alpha_v, u1, u2);
  *cosine = dot3(wi, m);
  return sub3(scale3(m, NUMBER(2) * *cosine), wi);
}

#endif
