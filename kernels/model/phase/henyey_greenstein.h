/* Henyey-Greenstein phase function [1/sr]
 *
 *   p(c; g) = (1 - g^2) / (4 pi (1 + g^2 - 2 g c)^(3/2))
 *
 * c: cosine of the angle between the directions of travel before and after the scattering, so c = 1 is straight on
 * (many texts use the angle between two directions that leave the vertex, which is -c). A c that rounding has put
 * beyond +-1 counts as +-1. g in (-1, 1): mean of c; 0: isotropic. The sampler is exact: its density is p.
 *   Henyey, Greenstein 1941, "Diffuse radiation in the galaxy", doi:10.1086/144246
 * Tests: tests/model/phase_henyey_greenstein_test.cpp */
#ifndef ITN_PHASE_HENYEY_GREENSTEIN_H
#define ITN_PHASE_HENYEY_GREENSTEIN_H
#include "model/obstacle.h"
#include "shared/declaration.h"

#define HENYEY_GREENSTEIN_NUMBERS(NUMBER) NUMBER(HENYEY_GREENSTEIN, g, 1, ROLE_DENSITY, COORDINATE_COSINE)
#define HENYEY_GREENSTEIN_PARAMETERS(PARAMETER) PARAMETER(g, COSINE, 0.8, "")
enum { HENYEY_GREENSTEIN_NUMBERS(DECLARE_SLOT) HENYEY_GREENSTEIN_SLOTS };

MODEL henyey_greenstein(REAL c, REAL g) {
  /* 1 + g^2 - 2 g c as a sum of a positive term and one that is not negative: keeps its digits in the peak */
  REAL a = ABS(g);
  REAL along = MIN(SELECT(g < NUMBER(0), -c, c), NUMBER(1));
  REAL d = (NUMBER(1) - a) * (NUMBER(1) - a) + NUMBER(2) * a * (NUMBER(1) - along);
  return NUMBER(0.0795774715459476679) * (NUMBER(1) - a) * (NUMBER(1) + a) / (d * SQRT(d));
}

/* Cosine and sine of the angle between the directions of travel, from u uniform in (0, 1).
 *
 * With s = 2 u - 1 and v = 1 - u, the inverse of the cumulative distribution is
 *   1 - c = 2 (1 - g)^2 v (1 + g u) / (1 + g s)^2,   1 + c = 2 (1 + g)^2 u (1 - g v) / (1 + g s)^2:
 * no division by g and no difference of like terms, hence the same code for g = 0 and for the sharpest peak. */
MODEL_VOID henyey_greenstein_sample(REAL g, REAL u, REAL* c, REAL* sine) {
  REAL v = NUMBER(1) - u;
  REAL p = NUMBER(1) + g, m = NUMBER(1) - g;
  REAL s = NUMBER(1) / (m * v + p * u);
  REAL forward = v * (NUMBER(1) + g * u);
  REAL backward = u * (NUMBER(1) - g * v);
  *c = NUMBER(1) - NUMBER(2) * m * m * forward * s * s;
  *sine = NUMBER(2) * m * p * SQRT(forward * backward) * s * s;
}

MODEL henyey_greenstein_value(const REAL* n, REAL cosine) { return henyey_greenstein(cosine, n[HENYEY_GREENSTEIN_g]); }

MODEL_VOID henyey_greenstein_draw(const REAL* n, REAL u, REAL* cosine, REAL* sine) {
  henyey_greenstein_sample(n[HENYEY_GREENSTEIN_g], u, cosine, sine);
}

MODEL henyey_greenstein_mean_cosine(const REAL* n) { return n[HENYEY_GREENSTEIN_g]; }

#ifndef __OPENCL_VERSION__
inline constexpr double greatest_g = 0.999999; /* of |g|: sharper peaks are rendered as this one, 1e-6 radian wide */

MODEL_VOID henyey_greenstein_numbers(const REAL* parameters, REAL* n) {
  n[0] = smaller(larger(parameters[0], REAL(-greatest_g)), REAL(greatest_g));
}
inline const char* henyey_greenstein_obstacle(const double* parameters, int) {
  return parameters[0] > greatest_g || parameters[0] < -greatest_g ? "g beyond 0.999999 is rendered as 0.999999"
                                                                   : differentiable;
}
#endif

#endif
