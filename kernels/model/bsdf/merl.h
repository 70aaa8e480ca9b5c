/* Measured reflectance of an isotropic surface: a table of the MERL database.
 *
 *   f |cos wo| = scale measured |wo.z| [1/sr];  0 unless both directions are above the surface
 *
 * measured: from the table, a channel each, linear in Rusinkiewicz's coordinates between the centres of its bins: 90 of
 * the angle theta_h between normal and half vector, which are narrow where gloss is (bin = 90 sqrt(theta_h / 90 degrees)),
 * 90 of the angle between half vector and wi (a degree each), 180 of the azimuth of wi about the half vector (a degree
 * each: a half turn more exchanges wi and wo). wi, wo: unit, leave the surface, in its frame. Who calls the functions below
 * has looked the values up (texture/measured.h), and they are numbers of the model until then 0: so formulas here see no table,
 * and scores are by `scale`, or by what stands around.
 *
 * A sample is of GGX's visible normals (alpha) with probability `gloss`, else of the cosine: both fitted to the table when
 * it is read (include/itn/measured_brdf.h).
 *   Matusik, Pfister, Brand, McMillan 2003, "A data-driven reflectance model", doi:10.1145/882262.882343
 *   Rusinkiewicz 1998, "A new change of variables for efficient BRDF representation", doi:10.1007/978-3-7091-6453-2_2
 * Tests: tests/model/merl_test.cpp, bsdfs_test.cpp; tests/transport/measured_test.cpp */
#ifndef ITN_MERL_H
#define ITN_MERL_H
#include "model/angle.h"
#include "model/bsdf/diffuse.h"
#include "model/bsdf/reflection.h"
#include "model/microfacet_reflection.h"
#include "model/obstacle.h"

#define MERL_HALF_BINS 90
#define MERL_DIFFERENCE_BINS 90
#define MERL_AZIMUTH_BINS 180
#define MERL_BINS (MERL_HALF_BINS * MERL_DIFFERENCE_BINS * MERL_AZIMUTH_BINS)

#define MERL_NUMBERS(NUMBER)                            \
  NUMBER(MERL, scale, 1, ROLE_FACTOR, COORDINATE_LOG)   \
  NUMBER(MERL, measured, 3, ROLE_FIXED, COORDINATE_LOG) \
  NUMBER(MERL, table, 1, ROLE_FIXED, COORDINATE_ITSELF) \
  NUMBER(MERL, alpha, 1, ROLE_FIXED, COORDINATE_LOG)    \
  NUMBER(MERL, gloss, 1, ROLE_FIXED, COORDINATE_ITSELF)
#define MERL_PARAMETERS(PARAMETER)            \
  PARAMETER(scale, NON_NEGATIVE, 1, "")       \
  PARAMETER(table, MEASURED_TABLE, 0, "")     \
  PARAMETER(alpha, MEASURED_ROUGHNESS, 1, "") \
  PARAMETER(gloss, MEASURED_GLOSS, 0.5, "")
#define MERL_TRAITS BSDF_MEASURED
#define MERL_RANDOM 3
enum { MERL_NUMBERS(DECLARE_SLOT) MERL_SLOTS };

/* The place of a pair of directions in the table, in bins from its beginning: half angle, difference angle, azimuth.
 * Both directions are above the surface; others give places, too, which mean nothing. */
MODEL_VOID merl_place(REAL3 wi, REAL3 wo, REAL* place) {
  REAL3 h = reflection_half(wi, wo);
  REAL sine = SQRT(h.x * h.x + h.y * h.y);
  MASK turned = sine > NUMBER(1e-7);
  REAL inverse = NUMBER(1) / MAX(sine, NUMBER(1e-7));
  REAL c = SELECT(turned, h.x * inverse, NUMBER(1)), s = SELECT(turned, h.y * inverse, NUMBER(0));
  /* wi where the half vector is the z axis */
  REAL x = (wi.x * c + wi.y * s) * h.z - wi.z * sine, y = wi.y * c - wi.x * s, z = dot3(wi, h);
  REAL azimuth = angle_of(y, x) * NUMBER(MERL_AZIMUTH_BINS / PI_);
  place[0] = SQRT(angle_of(sine, h.z) * NUMBER(2 / PI_)) * NUMBER(MERL_HALF_BINS);
  place[1] = angle_of(SQRT(x * x + y * y), z) * NUMBER(2 * MERL_DIFFERENCE_BINS / PI_);
  place[2] = SELECT(azimuth < NUMBER(0), azimuth + NUMBER(MERL_AZIMUTH_BINS), azimuth);
}

MODEL_VOID merl_value(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  MASK possible = (wi.z > NUMBER(0)) & (wo.z > NUMBER(0));
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    f[c] = SELECT(possible, n[MERL_scale] * n[MERL_measured + c] * wo.z, NUMBER(0));
}

MODEL merl_density(int variant, const REAL* n, REAL3 wi, REAL3 wo) {
  REAL glossy = reflection_density(MICROFACET_GGX, n[MERL_alpha], wi, wo);
  REAL density = n[MERL_gloss] * glossy + (NUMBER(1) - n[MERL_gloss]) * diffuse_pdf(wo);
  return SELECT((wi.z > NUMBER(0)) & (wo.z > NUMBER(0)), density, NUMBER(0));
}

/* Lost where a facet's mirror image is below the surface. */
MODEL_VOID merl_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                     REAL* inverse_eta) {
  REAL cosine;
  MASK glossy = u[0] < n[MERL_gloss];
  REAL3 mirrored = reflection_sample(MICROFACET_GGX, n[MERL_alpha], wi, u[1], u[2], &cosine);
  REAL3 matt = diffuse_sample(u[1], u[2]);
  *wo =
      make3(SELECT(glossy, mirrored.x, matt.x), SELECT(glossy, mirrored.y, matt.y), SELECT(glossy, mirrored.z, matt.z));
  *pdf = merl_density(variant, n, wi, *wo);
  *inverse_eta = NUMBER(1);
  REAL f[CHANNELS];
  merl_value(variant, n, wi, *wo, f);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    weight[c] = SELECT(*pdf > NUMBER(0), f[c] / MAX(*pdf, NUMBER(1e-20)), NUMBER(0));
}

BSDF_DECIDES_DIRECTION(merl)
BSDF_DRAWS_ALL(merl)

#ifndef __OPENCL_VERSION__
MODEL_VOID merl_numbers(int variant, const REAL* parameters, REAL* n) {
  n[MERL_scale] = parameters[0];
  for (int c = 0; c < 3; ++c) n[MERL_measured + c] = REAL(0);
  for (int k = 0; k < 3; ++k) n[MERL_table + k] = parameters[1 + k];
}
inline Refusal merl_refusal(const double*) { return {}; }
inline const char* merl_obstacle(const double* parameters, int slot) { return unless_zero(parameters[slot]); }
#endif

#endif
