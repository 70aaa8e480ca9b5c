/* Angle of the point (x, y) from the x axis [radian], in (-pi, pi]: atan2 in the common subset. Relative error 6e-10 in
 * double, 3e-7 in float. The origin has the angle 0.
 *
 * The polynomial is a minimax fit (Lawson's reweighted least squares) of atan(t) / t over t^2 in [0, tan(pi/8)^2], made
 * for this file; beyond tan(pi/8), atan(t) = pi/4 + atan((t - 1) / (t + 1)).
 * Tests: tests/scene/environment_test.cpp */
#ifndef ITN_ANGLE_H
#define ITN_ANGLE_H
#include "shared/portable.h"

MODEL angle_of(REAL y, REAL x) {
  REAL ax = ABS(x), ay = ABS(y);
  REAL small = MIN(ax, ay), large = MAX(ax, ay);
  MASK beyond = small > NUMBER(0.41421356237309503) * large;
  REAL over = SELECT(beyond, small - large, small);
  REAL under = SELECT(beyond, small + large, large);
  REAL t = over / SELECT(under > NUMBER(0), under, NUMBER(1));
  REAL t2 = t * t;
  REAL p = NUMBER(-0.06034790295064045);
  p = p * t2 + NUMBER(0.1057347977977863);
  p = p * t2 - NUMBER(0.1424008300443487);
  p = p * t2 + NUMBER(0.19998216947379882);
  p = p * t2 - NUMBER(0.33333307625837805);
  p = p * t2 + NUMBER(0.9999999993966711);
  REAL angle = SELECT(beyond, NUMBER(PI_ / 4), NUMBER(0)) + t * p;
  angle = SELECT(ay > ax, NUMBER(PI_ / 2) - angle, angle);
  angle = SELECT(x < NUMBER(0), NUMBER(PI_) - angle, angle);
  return SELECT(y < NUMBER(0), -angle, angle);
}

/* Angle between two unit vectors [radian]; keeps its digits near 0 and pi, where the arc cosine loses them. */
MODEL angle_between(REAL3 a, REAL3 b) {
  REAL3 c = cross3(a, b);
  return angle_of(SQRT(dot3(c, c)), dot3(a, b));
}

#endif
