/* Rough interface between two dielectrics: reflection and transmission at microfacets.
 *
 *   reflection    f = F D G / (4 |wi.z| |wo.z|),                                     h ~ wi + wo
 *   transmission  f = (1 - F) D G |wi.h| |wo.h| / (|wi.z| |wo.z| (wi.h + eta wo.h)^2),  h ~ wi + eta wo
 *   G = G1(wi) G1(wo), 0 where a direction lies on one side of the surface and on the other of the microfacet
 *
 * f [1/sr] is for radiance: transmission holds the factor 1 / eta^2 by which radiance changes between the media, so
 * that eta^2 f(wi, wo; eta) = f(wo, wi; 1 / eta). Agrees with Mitsuba 3's "roughdielectric" (visible normals).
 *
 * wi, wo: unit, leave the surface, in its frame; either may be on either side of the plane z = 0. Light arrives along
 * wo and leaves along wi (a path traced from the camera knows wi first). eta > 0, not 1: refractive index of the side
 * opposite to wi over that of wi's side. alpha > 0, see microfacet.h, distribution too.
 *   Walter, Marschner, Li, Torrance 2007, "Microfacet models for refraction through rough surfaces"
 * Tests: tests/model/rough_dielectric_test.cpp */
#ifndef ITN_ROUGH_DIELECTRIC_H
#define ITN_ROUGH_DIELECTRIC_H
#include "model/bsdf/reflection.h"
#include "model/fresnel_dielectric.h"
#include "model/microfacet.h"
#include "model/obstacle.h"

/* eta: inside over outside; the variants are the distributions */
#define ROUGH_DIELECTRIC_NUMBERS(NUMBER)                                        \
  NUMBER(ROUGH_DIELECTRIC, alpha, 1, ROLE_DENSITY, COORDINATE_LOG)              \
  NUMBER(ROUGH_DIELECTRIC, eta, 1, ROLE_INDEX, COORDINATE_LOG)                  \
  NUMBER(ROUGH_DIELECTRIC, specular_reflectance, 3, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(ROUGH_DIELECTRIC, specular_transmittance, 3, ROLE_FIXED, COORDINATE_LOG)
#define ROUGH_DIELECTRIC_PARAMETERS(PARAMETER) \
  PARAMETER(alpha, ROUGHNESS_TEXTURE, 0.1, "") \
  PARAMETER(int_ior, INDEX, 1.5046, "")        \
  PARAMETER(ext_ior, INDEX, 1.000277, "")      \
  PARAMETER(specular_reflectance, TINT, 1, "") \
  PARAMETER(specular_transmittance, TINT, 1, "")
#define ROUGH_DIELECTRIC_TRAITS (BSDF_TRANSMITS | BSDF_BASELINE)
#define ROUGH_DIELECTRIC_RANDOM 3
enum { ROUGH_DIELECTRIC_NUMBERS(DECLARE_SLOT) ROUGH_DIELECTRIC_SLOTS };

/* The normal of the microfacet that takes wo to wi. */
MODEL3 rough_dielectric_facet(REAL eta, REAL3 wi, REAL3 wo) {
  REAL3 sum = add3(wi, scale3(wo, SELECT(wi.z * wo.z > NUMBER(0), NUMBER(1), eta)));
  REAL scale = NUMBER(1) / SQRT(MAX(dot3(sum, sum), NUMBER(1e-20)));
  return scale3(sum, SELECT(sum.z < NUMBER(0), -scale, scale));
}

/* The factor that value and density share: the density of wo without G1(wo), that is Dv(h) |dh/dwo| F, or 1 - F for
 * transmission. 0 where G = 0 whatever G1 is. h: rough_dielectric_facet; seen: D(h) G1(wi) */
MODEL rough_dielectric_lobe(REAL eta, REAL3 wi, REAL3 wo, REAL3 h, REAL seen) {
  MASK reflected = wi.z * wo.z > NUMBER(0);
  REAL ci = dot3(wi, h), co = dot3(wo, h);
  MASK possible = (ci * wi.z > NUMBER(0)) & (co * wo.z > NUMBER(0));
  REAL f = fresnel_dielectric(MIN(ABS(ci), NUMBER(1)), eta);
  REAL d = ci + eta * co;
  REAL jacobian =
      SELECT(reflected, NUMBER(0.25) * f, (NUMBER(1) - f) * eta * eta * ABS(ci * co) / MAX(d * d, NUMBER(1e-20)));
  return SELECT(possible, seen * jacobian / ABS(wi.z), NUMBER(0));
}

MODEL rough_dielectric_half(int distribution, REAL alpha, REAL eta, REAL3 wi, REAL3 wo) {
  REAL3 h = rough_dielectric_facet(eta, wi, wo);
  REAL seen = microfacet_normals(distribution, h, alpha) * microfacet_shadowing(distribution, wi, alpha);
  return rough_dielectric_lobe(eta, wi, wo, h, seen);
}

/* The term that d log f / d eta lacks for GGX. D of upright microfacets (h.z = 0) is not 0, so transmission jumps to
 * 0 at the cone of wo where h.z = 0, and the cone moves with eta: the derivative of an integral of f is that of f plus
 * f on the cone times its motion. K(h.z) goes from K(0) = 0 to 1 at h.z = BAND; adding dK / d eta to the score spreads
 * the term over the band. K' has the integral 1 and the first moment 0 and ends at 0, so the error is of second order
 * in BAND: some percent of the term itself. */
#define ROUGH_DIELECTRIC_BAND 0.1
MODEL rough_dielectric_ggx_edge(REAL eta, REAL3 wi, REAL3 wo) {
  REAL3 sum = add3(wi, scale3(wo, SELECT(wi.z * wo.z > NUMBER(0), NUMBER(1), eta)));
  REAL upright = ABS(sum.z) / SQRT(MAX(dot3(sum, sum), NUMBER(1e-20)));
  REAL x = MIN(upright * NUMBER(1 / ROUGH_DIELECTRIC_BAND), NUMBER(1));
  return x * (NUMBER(6) - x * (NUMBER(9) - NUMBER(4) * x));
}

/* f |wo.z|. Zero, not NaN, for directions in the surface. Compilers share the work of this and the next function. */
MODEL rough_dielectric_eval(int distribution, REAL alpha, REAL eta, REAL3 wi, REAL3 wo) {
  REAL radiance = SELECT(wi.z * wo.z > NUMBER(0), NUMBER(1), NUMBER(1) / (eta * eta));
  return rough_dielectric_half(distribution, alpha, eta, wi, wo) * microfacet_shadowing(distribution, wo, alpha) *
         radiance;
}

/* Density of rough_dielectric_sample, per solid angle of wo. */
MODEL rough_dielectric_pdf(int distribution, REAL alpha, REAL eta, REAL3 wi, REAL3 wo) {
  return rough_dielectric_half(distribution, alpha, eta, wi, wo);
}

/* Reflection, if u0 < F, or transmission at the normal m. up: wi, on the side of m; *along_wi: 1, or 1 / eta for
 * transmission; *jacobian: |dm/dout| times F, or 1 - F; *possible: is `out` on its side of the surface? */
MODEL_VOID rough_dielectric_scatter(REAL eta, REAL3 up, REAL3 m, REAL u0, REAL3* out, REAL* along_wi, REAL* jacobian,
                                    MASK* reflected, MASK* possible) {
  REAL ci = dot3(up, m);
  REAL f, ct;
  fresnel_dielectric_refract(MIN(ABS(ci), NUMBER(1)), eta, &f, &ct);
  MASK mirror = u0 < f;
  *along_wi = SELECT(mirror, NUMBER(1), NUMBER(1) / eta);
  REAL along_m = SELECT(mirror, NUMBER(2) * ci, ci * *along_wi - ct);
  *out = sub3(scale3(m, along_m), scale3(up, *along_wi));
  *possible = (ci > NUMBER(0)) & (up.z > NUMBER(0)) & (SELECT(mirror, out->z, -out->z) > NUMBER(0));
  REAL d = ci - eta * ct;
  *jacobian = SELECT(mirror, NUMBER(0.25) * f, (NUMBER(1) - f) * eta * eta * ci * ct / MAX(d * d, NUMBER(1e-20)));
  *reflected = mirror;
}

/* Draws a visible normal with u1, u2 and then reflection, if u0 < F, or transmission.
 *
 * *weight = f |wo.z| / pdf = G1(wo), over eta^2 for transmission. 0 if wo comes out on the wrong side, which single
 * scattering at microfacets loses; *wo is then unit, but means nothing. */
MODEL_VOID rough_dielectric_sample(int distribution, REAL alpha, REAL eta, REAL3 wi, REAL u0, REAL u1, REAL u2,
                                   REAL3* wo, REAL* weight, REAL* pdf, MASK* reflected) {
  REAL side = SELECT(wi.z < NUMBER(0), NUMBER(-1), NUMBER(1));
  REAL3 up = make3(wi.x, wi.y, side * wi.z), out;
  REAL3 m = microfacet_visible_sample(distribution, up, alpha, u1, u2);
  REAL along_wi, jacobian;
  MASK possible = up.z > NUMBER(0);
  rough_dielectric_scatter(eta, up, m, u0, &out, &along_wi, &jacobian, reflected, &possible);
  *weight = SELECT(possible, microfacet_shadowing(distribution, out, alpha) * along_wi * along_wi, NUMBER(0));
  REAL density =
      microfacet_normals(distribution, m, alpha) * microfacet_shadowing(distribution, up, alpha) * jacobian / up.z;
  *pdf = SELECT(possible, density, NUMBER(0));
  *wo = make3(out.x, out.y, side * out.z);
}

/* The microfacet normal m that rough_dielectric_sample drew when it gave wo, lost samples included; m.wi >= 0. */
MODEL3 rough_dielectric_normal(REAL eta, REAL3 wi, REAL3 wo, REAL reflected) {
  REAL3 sum = add3(wi, scale3(wo, SELECT(reflected > NUMBER(0.5), NUMBER(1), eta)));
  REAL scale = NUMBER(1) / SQRT(MAX(dot3(sum, sum), NUMBER(1e-20)));
  return scale3(sum, SELECT(dot3(wi, sum) < NUMBER(0), -scale, scale));
}

/* Density of what rough_dielectric_sample decides: the normal m [1/sr], and reflection (reflected 1) or transmission (0).
 * Its integral over m and sum over both is 1: no sample is lost here. */
MODEL rough_dielectric_choice(int distribution, REAL alpha, REAL eta, REAL3 wi, REAL3 m, REAL reflected) {
  REAL f = fresnel_dielectric(MIN(ABS(dot3(wi, m)), NUMBER(1)), eta);
  return microfacet_visible_density(distribution, wi, m, alpha) * SELECT(reflected > NUMBER(0.5), f, NUMBER(1) - f);
}

MODEL rough_dielectric_tint(const REAL* n, int c, MASK reflected) {
  return SELECT(reflected, n[ROUGH_DIELECTRIC_specular_reflectance + c],
                n[ROUGH_DIELECTRIC_specular_transmittance + c]);
}

MODEL_VOID rough_dielectric_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  REAL eta = far_over_near(n[ROUGH_DIELECTRIC_eta], wi.z);
  REAL value = rough_dielectric_eval(variant, n[ROUGH_DIELECTRIC_alpha], eta, wi, wo);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) f[c] = value * rough_dielectric_tint(n, c, wi.z * wo.z > NUMBER(0));
}

MODEL rough_dielectric_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  return rough_dielectric_pdf(variant, n[ROUGH_DIELECTRIC_alpha], far_over_near(n[ROUGH_DIELECTRIC_eta], wi.z), wi, wo);
}

MODEL_VOID rough_dielectric_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight,
                                 REAL* pdf, REAL* inverse_eta) {
  REAL eta = far_over_near(n[ROUGH_DIELECTRIC_eta], wi.z), value;
  MASK reflected = wi.z > NUMBER(0);
  rough_dielectric_sample(variant, n[ROUGH_DIELECTRIC_alpha], eta, wi, u[0], u[1], u[2], wo, &value, pdf, &reflected);
  value *= SELECT(reflected, NUMBER(1), eta * eta);
  *inverse_eta = SELECT(reflected, NUMBER(1), NUMBER(1) / eta);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) weight[c] = value * rough_dielectric_tint(n, c, reflected);
}

MODEL3 rough_dielectric_outcome(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL reflected) {
  return rough_dielectric_normal(far_over_near(n[ROUGH_DIELECTRIC_eta], wi.z), wi, wo, reflected);
}

MODEL rough_dielectric_decision(int variant, const REAL* n, REAL3 wi, REAL3 outcome, REAL reflected) {
  return rough_dielectric_choice(variant, n[ROUGH_DIELECTRIC_alpha], far_over_near(n[ROUGH_DIELECTRIC_eta], wi.z), wi,
                                 outcome, reflected);
}

MODEL rough_dielectric_edge(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  if (variant != MICROFACET_GGX) return NUMBER(0);
  return rough_dielectric_ggx_edge(far_over_near(n[ROUGH_DIELECTRIC_eta], wi.z), wi, wo);
}

BSDF_DRAWS_ALL(rough_dielectric)

#ifndef __OPENCL_VERSION__
MODEL_VOID rough_dielectric_numbers(int variant, const REAL* parameters, REAL* n) {
  n[ROUGH_DIELECTRIC_alpha] = larger(parameters[0], REAL(least_alpha));
  n[ROUGH_DIELECTRIC_eta] = parameters[1] / parameters[2];
  for (int k = 0; k < 6; ++k) n[ROUGH_DIELECTRIC_specular_reflectance + k] = parameters[3 + k];
}
inline Refusal rough_dielectric_refusal(const double* parameters) {
  if (parameters[1] != parameters[2]) return {};
  return {"int_ior", "and ext_ior are both", parameters[1],
          "need different ones: for an index-matched boundary use null"};
}
inline const char* rough_dielectric_obstacle(const double* parameters, int slot) {
  if (slot > 2) return "a tint, by which the renderer does not differentiate";
  const double ratio = parameters[1] / parameters[2];
  if (ratio - 1 < 1e-4 && 1 - ratio < 1e-4)
    return "the two indices are nearly equal, and light goes straight on: use a bsdf null";
  if (ratio < 1e-3 || ratio > 1e3)
    return "the ratio of the two indices is beyond 1000, where single precision loses its score";
  return parameters[0] < least_alpha ? "alpha below 0.0001 is rendered as 0.0001" : differentiable;
}
#endif

#endif
