/* Media by scattering and absorption coefficients in place of extinction and albedo, for the host alone: from there on they
 * are the media of homogeneous.h and heterogeneous.h, with
 *
 *   sigma_t = sigma_s + sigma_a        [1 / scene unit]
 *   albedo  = sigma_s / sigma_t
 *   sigma_s = sigma_s_prime / (1 - g)  where reduced scattering is given; g: the mean cosine of the phase function
 *
 * scale is a factor on both coefficients, and so is, in a heterogeneous medium, the density, which may be a grid of
 * voxels. Light that scatters often tells sigma_s_prime and sigma_a apart long before g (similarity relation).
 *
 *   van de Hulst 1980, Multiple Light Scattering, section 14.1; Bevilacqua, Depeursinge 1999,
 *   doi:10.1364/JOSAA.16.002935 (reduced scattering)
 *
 * sigma_s, sigma_a, sigma_s_prime, density, scale >= 0, -1 < g < 1.
 * Tests: tests/scene/medium_inputs_test.cpp, and tests/transport/coefficients_test.cpp */
#ifndef ITN_MEDIUM_BY_SCATTERING_H
#define ITN_MEDIUM_BY_SCATTERING_H
#include "model/medium/heterogeneous.h"

#ifndef __OPENCL_VERSION__
#define HOMOGENEOUS_BY_SCATTERING_PARAMETERS(PARAMETER) \
  PARAMETER(sigma_s, EXTINCTION, 0, "1/scene unit")     \
  PARAMETER(sigma_a, EXTINCTION, 0, "1/scene unit")     \
  PARAMETER(scale, NON_NEGATIVE, 1, "")
#define HOMOGENEOUS_BY_REDUCED_SCATTERING_PARAMETERS(PARAMETER) \
  PARAMETER(sigma_s_prime, EXTINCTION, 0, "1/scene unit")       \
  PARAMETER(sigma_a, EXTINCTION, 0, "1/scene unit")             \
  PARAMETER(scale, NON_NEGATIVE, 1, "")                         \
  PARAMETER(mean_cosine, MEAN_COSINE, 0, "")
/* A grid of voxels counts as 1 here. */
#define HETEROGENEOUS_BY_SCATTERING_PARAMETERS(PARAMETER) \
  PARAMETER(sigma_s, EXTINCTION, 0, "1/scene unit")       \
  PARAMETER(sigma_a, EXTINCTION, 0, "1/scene unit")       \
  PARAMETER(density, DENSITY_VOLUME, 1, "")               \
  PARAMETER(scale, NON_NEGATIVE, 1, "")
#define HETEROGENEOUS_BY_REDUCED_SCATTERING_PARAMETERS(PARAMETER) \
  PARAMETER(sigma_s_prime, EXTINCTION, 0, "1/scene unit")         \
  PARAMETER(sigma_a, EXTINCTION, 0, "1/scene unit")               \
  PARAMETER(density, DENSITY_VOLUME, 1, "")                       \
  PARAMETER(scale, NON_NEGATIVE, 1, "")                           \
  PARAMETER(mean_cosine, MEAN_COSINE, 0, "")

/* The numbers are the medium's. */
#define HOMOGENEOUS_BY_SCATTERING_NUMBERS HOMOGENEOUS_NUMBERS
#define HOMOGENEOUS_BY_REDUCED_SCATTERING_NUMBERS HOMOGENEOUS_NUMBERS
#define HETEROGENEOUS_BY_SCATTERING_NUMBERS HETEROGENEOUS_NUMBERS
#define HETEROGENEOUS_BY_REDUCED_SCATTERING_NUMBERS HETEROGENEOUS_NUMBERS
enum {
  HOMOGENEOUS_BY_SCATTERING_SLOTS = HOMOGENEOUS_SLOTS,
  HOMOGENEOUS_BY_REDUCED_SCATTERING_SLOTS = HOMOGENEOUS_SLOTS,
  HETEROGENEOUS_BY_SCATTERING_SLOTS = HETEROGENEOUS_SLOTS,
  HETEROGENEOUS_BY_REDUCED_SCATTERING_SLOTS = HETEROGENEOUS_SLOTS
};

/* coefficients: sigma_s (3), sigma_a (3); amount: what both are times, a channel each */
MODEL_VOID numbers_by_scattering(const REAL* coefficients, const REAL* amount, REAL* n) {
  for (int c = 0; c < 3; ++c) {
    const REAL sigma_s = coefficients[c], sum = sigma_s + coefficients[3 + c];
    n[HOMOGENEOUS_sigma_t + c] = smaller(sum * amount[c], REAL(greatest_sigma_t));
    n[HOMOGENEOUS_albedo + c] = SELECT(sum > REAL(0), sigma_s / SELECT(sum > REAL(0), sum, 1), 0);
  }
}

/* coefficients: sigma_s_prime (3), sigma_a (3) */
MODEL_VOID numbers_by_reduced_scattering(const REAL* coefficients, const REAL* amount, const REAL& mean_cosine,
                                         REAL* n) {
  REAL full[6];
  for (int c = 0; c < 3; ++c) {
    full[c] = coefficients[c] / (REAL(1) - mean_cosine);
    full[3 + c] = coefficients[3 + c];
  }
  numbers_by_scattering(full, amount, n);
}

MODEL_VOID homogeneous_by_scattering_numbers(const REAL* parameters, REAL* n) {
  const REAL amount[3] = {parameters[6], parameters[6], parameters[6]};
  numbers_by_scattering(parameters, amount, n);
}

MODEL_VOID homogeneous_by_reduced_scattering_numbers(const REAL* parameters, REAL* n) {
  const REAL amount[3] = {parameters[6], parameters[6], parameters[6]};
  numbers_by_reduced_scattering(parameters, amount, parameters[7], n);
}

/* density (3) and scale stand behind the coefficients */
MODEL_VOID heterogeneous_by_scattering_numbers(const REAL* parameters, REAL* n) {
  const REAL scale = parameters[9];
  const REAL amount[3] = {parameters[6] * scale, parameters[7] * scale, parameters[8] * scale};
  numbers_by_scattering(parameters, amount, n);
}

MODEL_VOID heterogeneous_by_reduced_scattering_numbers(const REAL* parameters, REAL* n) {
  const REAL scale = parameters[9];
  const REAL amount[3] = {parameters[6] * scale, parameters[7] * scale, parameters[8] * scale};
  numbers_by_reduced_scattering(parameters, amount, parameters[10], n);
}

/* slot: of the scattering or the absorption coefficients, of the density, or behind them. Without scattering an albedo of
 * 0 would have to grow; absorption may be 0 where light scatters. */
inline const char* by_scattering_obstacle(const double* coefficients, const double* amount, int slot) {
  const auto extinction = [&](int c) {
    return homogeneous_extinction_obstacle((coefficients[c] + coefficients[3 + c]) * amount[c]);
  };
  if (slot >= 9) {
    const char* obstacle = differentiable;
    for (int c = 0; c < 3; ++c)
      if (coefficients[c] + coefficients[3 + c] > 0 && !*obstacle) obstacle = extinction(c);
    return obstacle;
  }
  const int c = slot % 3;
  if (slot < 3 && *unless_zero(coefficients[c])) return unless_zero(coefficients[c]);
  return extinction(c);
}

inline const char* homogeneous_by_scattering_obstacle(const double* parameters, int slot) {
  const double amount[3] = {parameters[6], parameters[6], parameters[6]};
  return by_scattering_obstacle(parameters, amount, slot < 6 ? slot : 9);
}

inline const char* homogeneous_by_reduced_scattering_obstacle(const double* parameters, int slot) {
  return homogeneous_by_scattering_obstacle(parameters, slot);
}

inline const char* heterogeneous_by_scattering_obstacle(const double* parameters, int slot) {
  const double scale = parameters[9];
  const double amount[3] = {parameters[6] * scale, parameters[7] * scale, parameters[8] * scale};
  return by_scattering_obstacle(parameters, amount, slot);
}

inline const char* heterogeneous_by_reduced_scattering_obstacle(const double* parameters, int slot) {
  return heterogeneous_by_scattering_obstacle(parameters, slot);
}
#endif

#endif
