/* Homogeneous medium
 *
 *   transmittance      T(d) = exp(-sigma_t d)            [1]
 *   free flight        p(d) = sigma_t exp(-sigma_t d)    [1 / scene unit]
 *
 * sigma_t >= 0: extinction [1 / scene unit]. d >= 0: distance [scene unit].
 * Tests: tests/model/medium_homogeneous_test.cpp */
#ifndef ITN_MEDIUM_HOMOGENEOUS_H
#define ITN_MEDIUM_HOMOGENEOUS_H
#include "shared/portable.h"

MODEL medium_transmittance(REAL sigma_t, REAL distance) { return EXP(-(sigma_t * distance)); }

MODEL medium_free_flight(REAL sigma_t, REAL distance) { return sigma_t * medium_transmittance(sigma_t, distance); }

/* Distance to the next collision, u uniform in (0, 1); infinite for sigma_t = 0. */
MODEL medium_free_flight_sample(REAL sigma_t, REAL u) { return -LOG(u) / sigma_t; }

#endif
