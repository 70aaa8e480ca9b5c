/* A linear polariser for light that has no polarisation: half of it passes straight on, times the transmittance.
 *
 *   passed  transmittance / 2
 *
 * wi, wo: unit, leave the surface, in its frame; wi on either side. theta, the angle of its axis, changes nothing here.
 * Agrees with Mitsuba 3's "polarizer" in variants without polarisation.
 * Tests: tests/model/bsdfs_test.cpp */
#ifndef ITN_POLARIZER_H
#define ITN_POLARIZER_H
#include "model/bsdf/reflection.h"
#include "model/obstacle.h"

#define POLARIZER_NUMBERS(NUMBER) NUMBER(POLARIZER, transmittance, 3, ROLE_FACTOR, COORDINATE_LOG)
#define POLARIZER_PARAMETERS(PARAMETER)        \
  PARAMETER(transmittance, REFLECTANCE, 1, "") \
  PARAMETER(theta, ANGLE, 0, "degree")         \
  PARAMETER(polarizing, FLAG, 1, "")
#define POLARIZER_TRAITS (BSDF_TRANSMITS | BSDF_SMOOTH | BSDF_THIN)
#define POLARIZER_RANDOM 0
enum { POLARIZER_NUMBERS(DECLARE_SLOT) POLARIZER_SLOTS };

MODEL_VOID polarizer_chosen(int variant, const REAL* n, REAL3 wi, REAL3 wo, REAL* f) {
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c)
    f[c] = SELECT(wi.z * wo.z > NUMBER(0), NUMBER(0), NUMBER(0.5) * n[POLARIZER_transmittance + c]);
}

MODEL_VOID polarizer_draw(int variant, const REAL* n, REAL3 wi, const REAL* u, REAL3* wo, REAL* weight, REAL* pdf,
                          REAL* inverse_eta) {
  *wo = scale3(wi, NUMBER(-1));
  *pdf = NUMBER(0);
  *inverse_eta = NUMBER(1);
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) weight[c] = NUMBER(0.5) * n[POLARIZER_transmittance + c];
}

BSDF_CHOOSES_ALL(polarizer)
BSDF_DECIDES_DIRECTION(polarizer)

#ifndef __OPENCL_VERSION__
MODEL_VOID polarizer_numbers(int variant, const REAL* parameters, REAL* n) {
  for (int c = 0; c < 3; ++c) n[c] = parameters[c];
}
inline Refusal polarizer_refusal(const double*) { return {}; }
inline const char* polarizer_obstacle(const double* parameters, int slot) { return unless_zero(parameters[slot]); }
#endif

#endif
