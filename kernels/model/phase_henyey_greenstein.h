/* Henyey-Greenstein phase function [1/sr]
 *
 *   p(c; g) = (1 - g^2) / (4 pi (1 + g^2 - 2 g c)^(3/2))
 *
 * c: cosine of the angle between the directions of travel before and after the scattering, so c = 1 is straight on
 * (many texts use the angle between two directions that leave the vertex, which is -c). A c that rounding has put beyond
 * +-1 counts as +-1. g in (-1, 1): mean of c; 0: isotropic. The sampler is exact: its density is p.
 *   Henyey, Greenstein 1941, "Diffuse radiation in the galaxy", doi:10.1086/144246
 * Tests: tests/model/phase_henyey_greenstein_test.cpp */
#ifndef ITN_PHASE_HENYEY_GREENSTEIN_H
#define ITN_PHASE_HENYEY_GREENSTEIN_H
#include "shared/portable.h"

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

#endif
