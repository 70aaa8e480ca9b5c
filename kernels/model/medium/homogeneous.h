/* Homogeneous medium
 *
 *   transmittance      T(d) = exp(-sigma_t d)            [1]
 *   free flight        p(d) = sigma_t exp(-sigma_t d)    [1 / scene unit]
 *
 * sigma_t >= 0: extinction [1 / scene unit]. d >= 0: distance [scene unit].
 * Tests: tests/model/medium_homogeneous_test.cpp */
#ifndef ITN_MEDIUM_HOMOGENEOUS_H
#define ITN_MEDIUM_HOMOGENEOUS_H
#include "model/obstacle.h"
#include "shared/declaration.h"

#define HOMOGENEOUS_NUMBERS(NUMBER)                             \
  NUMBER(HOMOGENEOUS, sigma_t, 3, ROLE_DENSITY, COORDINATE_LOG) \
  NUMBER(HOMOGENEOUS, albedo, 3, ROLE_FACTOR, COORDINATE_LOG)
#define HOMOGENEOUS_PARAMETERS(PARAMETER)           \
  PARAMETER(sigma_t, EXTINCTION, 1, "1/scene unit") \
  PARAMETER(albedo, ALBEDO_VOLUME, 0.75, "")        \
  PARAMETER(scale, NON_NEGATIVE, 1, "")
enum { HOMOGENEOUS_NUMBERS(DECLARE_SLOT) HOMOGENEOUS_SLOTS };

MODEL medium_transmittance(REAL sigma_t, REAL distance) { return EXP(-(sigma_t * distance)); }

MODEL medium_free_flight(REAL sigma_t, REAL distance) { return sigma_t * medium_transmittance(sigma_t, distance); }

/* Distance to the next collision, u uniform in (0, 1); infinite for sigma_t = 0. */
MODEL medium_free_flight_sample(REAL sigma_t, REAL u) { return -LOG(u) / sigma_t; }

/* Factors of a path's throughput, a channel each: of a flight that ends in a scattering, and of one that reaches a
 * surface. */
MODEL_VOID homogeneous_scattering(const REAL* n, REAL distance, REAL* f) {
  for (int c = 0; c < CHANNELS; ++c)
    f[c] = medium_free_flight(n[HOMOGENEOUS_sigma_t + c], distance) * n[HOMOGENEOUS_albedo + c];
}

MODEL_VOID homogeneous_passage(const REAL* n, REAL distance, REAL* f) {
  for (int c = 0; c < CHANNELS; ++c) f[c] = medium_transmittance(n[HOMOGENEOUS_sigma_t + c], distance);
}

#ifndef __OPENCL_VERSION__
inline constexpr double greatest_sigma_t = 1e30; /* [1 / scene unit]: denser media are rendered as this one */

/* parameters: sigma_t (3), albedo (3), scale */
MODEL_VOID homogeneous_numbers(const REAL* parameters, REAL* n) {
  for (int c = 0; c < 3; ++c) {
    n[HOMOGENEOUS_sigma_t + c] = smaller(parameters[c] * parameters[6], REAL(greatest_sigma_t));
    n[HOMOGENEOUS_albedo + c] = parameters[3 + c];
  }
}

inline const char* homogeneous_extinction_obstacle(double sigma_t) {
  return sigma_t > greatest_sigma_t ? "sigma_t times scale above 1e30 is rendered as 1e30" : unless_zero(sigma_t);
}

inline const char* homogeneous_obstacle(const double* parameters, int slot) {
  const double scale = parameters[6];
  if (slot < 3) return homogeneous_extinction_obstacle(scale > 0 ? parameters[slot] * scale : parameters[slot]);
  if (slot < 6) return unless_zero(parameters[slot]);
  const char* obstacle = unless_zero(scale);
  for (int c = 0; c < 3; ++c)
    if (parameters[c] > 0 && !*obstacle) obstacle = homogeneous_extinction_obstacle(parameters[c] * scale);
  return obstacle;
}
#endif

#endif
