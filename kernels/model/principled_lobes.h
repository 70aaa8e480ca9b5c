/* Common code of the principled BSDFs: the lobes of Burley's model as Mitsuba 3 has it ("principled",
 * "principledthin"), and the numbers that all of them have.
 *
 *   w(c) = (1 - c)^5, Schlick's weight; c: cosine of incidence on the denser side
 *   base      base_color / pi cos wo ((1 - flatness) (f_d + f_r) + flatness f_s) [1/sr], with Fi = w(wi.z), Fo =
 *             w(wo.z), f_d = (1 - Fi / 2) (1 - Fo / 2), R = 2 roughness (h.wo)^2, f_r = R (Fo + Fi + Fo Fi (R - 1)),
 *             f_s = 1.25 (S (1 / (wi.z + wo.z) - 1/2) + 1/2), S = (1 + (R / 2 - 1) Fo) (1 + (R / 2 - 1) Fi)
 *   sheen     sheen w(h.wo) cos wo tint, tint from white (sheen_tint 0) to the hue of base_color (1)
 *   clearcoat clearcoat / 4 F(0.04) D1(h) G1(wi; 0.25) G1(wo; 0.25) cos wo, D1(h) = (a^2 - 1) / (pi log(a^2) (1 +
 *             (a^2 - 1) h.z^2)), a = 0.1 - 0.099 clearcoat_gloss, G1 of GGX
 *   facets    GGX (microfacet_anisotropic.h) with alpha = roughness^2 / aspect and roughness^2 aspect along x and y,
 *             aspect = sqrt(1 - 0.9 anisotropic), both at least 0.001
 *
 * wi, wo: unit, leave the surface on the side of its normal; h ~ wi + wo. All weights in [0, 1]. hue: base_color
 * over its luminance.
 *   Burley 2012, "Physically-based shading at Disney"
 *   Burley 2015, "Extending the Disney BRDF to a BSDF with integrated subsurface scattering"
 * Tests: tests/model/bsdfs_test.cpp, through the BSDFs that have it */
#ifndef ITN_PRINCIPLED_LOBES_H
#define ITN_PRINCIPLED_LOBES_H
#include "model/bsdf/diffuse.h"
#include "model/fresnel_dielectric.h"
#include "model/microfacet_anisotropic.h"
#include "model/obstacle.h"

/* The first of each one's numbers, and of its parameters. */
#define PRINCIPLED_COMMON_NUMBERS(NUMBER, PREFIX)                 \
  NUMBER(PREFIX, base_color, 3, ROLE_FACTOR, COORDINATE_LOG)      \
  NUMBER(PREFIX, roughness, 1, ROLE_DENSITY, COORDINATE_LOG)      \
  NUMBER(PREFIX, anisotropic, 1, ROLE_DENSITY, COORDINATE_ITSELF) \
  NUMBER(PREFIX, spec_tint, 1, ROLE_FACTOR, COORDINATE_ITSELF)    \
  NUMBER(PREFIX, sheen, 1, ROLE_FACTOR, COORDINATE_ITSELF)        \
  NUMBER(PREFIX, sheen_tint, 1, ROLE_FACTOR, COORDINATE_ITSELF)   \
  NUMBER(PREFIX, flatness, 1, ROLE_FACTOR, COORDINATE_ITSELF)
#define PRINCIPLED_COMMON_PARAMETERS(PARAMETER) \
  PARAMETER(base_color, REFLECTANCE, 0.5, "")   \
  PARAMETER(roughness, WEIGHT, 0.5, "")         \
  PARAMETER(anisotropic, WEIGHT, 0, "")         \
  PARAMETER(spec_tint, WEIGHT, 0, "")           \
  PARAMETER(sheen, WEIGHT, 0, "")               \
  PARAMETER(sheen_tint, WEIGHT, 0, "")          \
  PARAMETER(flatness, WEIGHT, 0, "")
enum { PRINCIPLED_COMMON_NUMBERS(DECLARE_SLOT, LOBES) LOBES_COMMON_SLOTS };

MODEL principled_luminance(const REAL* colour) {
#if CHANNELS == 1
  return colour[0];
#else
  return NUMBER(0.212671) * colour[0] + NUMBER(0.715160) * colour[1] + NUMBER(0.072169) * colour[2];
#endif
}

/* base_color over its luminance */
MODEL principled_hue(const REAL* n, REAL luminance, int c) {
  return SELECT(luminance > NUMBER(0), n[LOBES_base_color + c] / MAX(luminance, NUMBER(1e-20)), NUMBER(1));
}

MODEL schlick_weight(REAL cosine) {
  REAL m = MIN(MAX(NUMBER(1) - cosine, NUMBER(0)), NUMBER(1));
  return m * m * m * m * m;
}

/* Schlick's weight at an interface; eta: far over near index. Under a denser medium the angle is the refracted
 * one's. */
MODEL schlick_interface(REAL cosine, REAL eta) {
  REAL square = fresnel_refracted_square(cosine, eta);
  MASK refracted = square > NUMBER(0);
  REAL cos_t = SELECT(refracted, SQRT(SELECT(refracted, square, NUMBER(1))) / eta, NUMBER(0));
  return schlick_weight(SELECT(eta > NUMBER(1), cosine, cos_t));
}

MODEL schlick(REAL upright, REAL weight) { return upright + weight * (NUMBER(1) - upright); }

/* Reflectance at normal incidence */
MODEL schlick_upright(REAL eta) {
  REAL r = (eta - NUMBER(1)) / (eta + NUMBER(1));
  return r * r;
}

MODEL_VOID principled_alphas(REAL roughness, REAL anisotropic, REAL* alpha_u, REAL* alpha_v) {
  REAL aspect = SQRT(NUMBER(1) - NUMBER(0.9) * anisotropic), square = roughness * roughness;
  *alpha_u = MAX(square / aspect, NUMBER(0.001));
  *alpha_v = MAX(square * aspect, NUMBER(0.001));
}

/* Both share `cosine`, h.wo. */
MODEL principled_base(const REAL* n, REAL3 wi, REAL3 wo, REAL cosine) {
  REAL fi = schlick_weight(wi.z), fo = schlick_weight(wo.z);
  REAL r = NUMBER(2) * n[LOBES_roughness] * cosine * cosine;
  REAL diffuse = (NUMBER(1) - NUMBER(0.5) * fi) * (NUMBER(1) - NUMBER(0.5) * fo);
  REAL retro = r * (fo + fi + fo * fi * (r - NUMBER(1)));
  REAL under = NUMBER(0.5) * r - NUMBER(1);
  REAL spread = (NUMBER(1) + under * fo) * (NUMBER(1) + under * fi);
  REAL flat = NUMBER(1.25) * (spread * (NUMBER(1) / MAX(wi.z + wo.z, NUMBER(1e-9)) - NUMBER(0.5)) + NUMBER(0.5));
  return diffuse + retro + n[LOBES_flatness] * (flat - diffuse - retro);
}

/* Base and sheen of channel c, times cos wo; base: principled_base. 0 unless wo.z > 0 */
MODEL principled_matt(const REAL* n, int c, REAL base, REAL luminance, REAL cosine, REAL3 wo) {
  REAL tint = NUMBER(1) + n[LOBES_sheen_tint] * (principled_hue(n, luminance, c) - NUMBER(1));
  return diffuse_eval(n[LOBES_base_color + c], wo) * base +
         n[LOBES_sheen] * schlick_weight(cosine) * tint * MAX(wo.z, NUMBER(0));
}

MODEL clearcoat_alpha(REAL gloss) { return NUMBER(0.1) - NUMBER(0.099) * gloss; }

/* D1; h.z^2 = 1 - h.x^2 - h.y^2, so that nothing is lost near the peak */
MODEL clearcoat_normals(REAL3 h, REAL alpha) {
  REAL a2 = alpha * alpha;
  return (a2 - NUMBER(1)) / (NUMBER(PI_) * LOG(a2) * (h.x * h.x + h.y * h.y + a2 * h.z * h.z));
}

/* A normal with density D1 h.z */
MODEL3 clearcoat_sample(REAL alpha, REAL u1, REAL u2) {
  REAL a2 = alpha * alpha, s, c;
  sin_cos_2pi(u1, &s, &c);
  REAL sine2 = a2 * (EXP(-u2 * LOG(a2)) - NUMBER(1)) / (NUMBER(1) - a2);
  REAL sine = SQRT(MIN(MAX(sine2, NUMBER(0)), NUMBER(1)));
  return make3(sine * c, sine * s, SQRT(MAX(NUMBER(1) - sine * sine, NUMBER(0))));
}

/* Without `clearcoat`; h.wi = h.wo = cosine. eta: inside over outside, of the angle in Schlick's F alone */
MODEL clearcoat_value(REAL gloss, REAL eta, REAL3 wi, REAL3 wo, REAL3 h, REAL cosine) {
  REAL fresnel = schlick(NUMBER(0.04), schlick_interface(cosine, eta));
  return NUMBER(0.25) * fresnel * clearcoat_normals(h, clearcoat_alpha(gloss)) * ggx_shadowing(wi, NUMBER(0.25)) *
         ggx_shadowing(wo, NUMBER(0.25)) * wo.z;
}

/* The density of mirror images at clearcoat_sample's normals [1/sr] */
MODEL clearcoat_density(REAL gloss, REAL3 h, REAL cosine) {
  return clearcoat_normals(h, clearcoat_alpha(gloss)) * h.z / (NUMBER(4) * MAX(cosine, NUMBER(1e-9)));
}

/* Reflectance of a facet from outside, of channel c: dielectric, tinted towards base_color by spec_tint, and metal of
 * colour base_color. f: unpolarised reflectance; weight: schlick_interface */
MODEL principled_reflectance(const REAL* n, int c, REAL metallic, REAL eta, REAL f, REAL weight, REAL luminance) {
  REAL tinted = schlick(principled_hue(n, luminance, c) * schlick_upright(eta), weight);
  REAL dielectric = f + n[LOBES_spec_tint] * (tinted - f);
  return dielectric + metallic * (schlick(n[LOBES_base_color + c], weight) - dielectric);
}

MODEL3 mirrored_at(REAL3 wi, REAL3 m) { return sub3(scale3(m, NUMBER(2) * dot3(wi, m)), wi); }

#ifndef __OPENCL_VERSION__
inline Refusal no_sampling_refusal(const char* parameter, double rates) {
  if (rates > 0) return {};
  return {parameter, "and the other sampling rates sum to", rates, "need one that is more than 0"};
}
/* The obstacle of parameters that are common numbers of the principled BSDFs. */
inline const char* principled_common_obstacle(const double* parameters, int slot) {
  if (slot <= LOBES_base_color_last) return unless_zero(parameters[slot]);
  const double alpha = parameters[LOBES_roughness] * parameters[LOBES_roughness];
  if (slot == LOBES_roughness && alpha < 0.001) return "alpha, its square, is rendered as 0.001 where it is less";
  return differentiable;
}
inline const char* principled_index_obstacle(double eta) {
  if (eta - 1 < 1e-4 && 1 - eta < 1e-4) return "1: nothing is mirrored, and there is a kink; start from another value";
  return eta < 1e-3 || eta > 1e3 ? "beyond 1000, where single precision loses its score" : differentiable;
}
#endif

#endif
