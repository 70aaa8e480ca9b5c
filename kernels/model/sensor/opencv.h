/* The lens distortion of OpenCV's camera model (its manual, "Camera Calibration and 3D Reconstruction"). A point that an
 * ideal camera sees at (x, y), in units of the focal length, x to the right and y down, appears at
 *   x' = x R + 2 p1 x y + p2 (r^2 + 2 x^2)
 *   y' = y R + p1 (r^2 + 2 y^2) + 2 p2 x y
 * with r^2 = x^2 + y^2 and R = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6).
 * k: k1, k2, k3, k4, k5, k6, p1, p2.
 * Tests: tests/model/opencv_camera_test.cpp */
#ifndef ITN_OPENCV_H
#define ITN_OPENCV_H
#include "shared/portable.h"

MODEL_VOID opencv_distort(const REAL k[], REAL x, REAL y, REAL* to_x, REAL* to_y) {
  const REAL r2 = x * x + y * y;
  const REAL above = NUMBER(1) + r2 * (k[0] + r2 * (k[1] + r2 * k[2]));
  const REAL below = NUMBER(1) + r2 * (k[3] + r2 * (k[4] + r2 * k[5]));
  const REAL radial = above / below, xy = NUMBER(2) * x * y;
  *to_x = x * radial + k[6] * xy + k[7] * (r2 + NUMBER(2) * x * x);
  *to_y = y * radial + k[6] * (r2 + NUMBER(2) * y * y) + k[7] * xy;
}

/* The point that appears at (x, y): Newton's method from there, with differences for derivatives. Whoever sets k has seen
 * that it converges everywhere on the film (runtime/scene/xml/sensor.cpp). */
MODEL_VOID opencv_undistort(const REAL k[], REAL x, REAL y, REAL* to_x, REAL* to_y) {
  const REAL step = NUMBER(1.0 / 256);
  REAL u = x, v = y;
  for (int i = 0; i < 6; ++i) {
    REAL x0, y0, xu, yu, xv, yv;
    opencv_distort(k, u, v, &x0, &y0);
    opencv_distort(k, u + step, v, &xu, &yu);
    opencv_distort(k, u, v + step, &xv, &yv);
    const REAL a = xu - x0, b = xv - x0, c = yu - y0, d = yv - y0;
    const REAL scale = step / (a * d - b * c);
    u = u - scale * (d * (x0 - x) - b * (y0 - y));
    v = v - scale * (a * (y0 - y) - c * (x0 - x));
  }
  *to_x = u;
  *to_y = v;
}

#endif
