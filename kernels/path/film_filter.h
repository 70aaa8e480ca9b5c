/* Positions within a pixel's reconstruction filter. */
#ifndef ITN_FILM_FILTER_H
#define ITN_FILM_FILTER_H
#include "path/launch.h"

#define GAUSSIAN_REACH 4.0f /* standard deviations */

INLINE REAL tent_offset(REAL u) {
  return SELECT(u < 0.5f, SQRT(2.0f * u) - 1.0f, 1.0f - SQRT(MAX((REAL)0.0f, 2.0f - 2.0f * u)));
}

/* Offset from the pixel's centre [pixel]. */
INLINE void sample_filter(int filter, float size, REAL u, REAL v, REAL* x, REAL* y) {
  if (filter == FILTER_GAUSSIAN) { /* cut at four standard deviations: exp(-8) */
    REAL radius = size * SQRT(-2.0f * LOG((REAL)3.3546e-4f + (REAL)0.99966454f * u));
    REAL s, c;
    sin_cos_2pi(v, &s, &c);
    *x = radius * c;
    *y = radius * s;
  } else if (filter == FILTER_TENT) {
    *x = size * tent_offset(u);
    *y = size * tent_offset(v);
  } else {
    *x = u - 0.5f;
    *y = v - 0.5f;
  }
}

#if HAS_FILM_EDGES
/* Share of a gaussian of standard deviation 1 that lies below x, |x| <= 4. Polynomials: least squares made for this file; the
 * share is right to 1e-5, and so is the place that a share belongs to. */
INLINE REAL gaussian_share(REAL x) {
  const REAL a = ABS(x);
  REAL p = NUMBER(-1.096747986e-4);
  p = p * a + 1.721742378e-3f;
  p = p * a - 1.162733675e-2f;
  p = p * a + 4.572370633e-2f;
  p = p * a - 1.220007871e-1f;
  p = p * a + 2.463664767e-1f;
  p = p * a - 3.984795429e-1f;
  p = p * a + 4.999902505e-1f;
  const REAL beyond = EXP(-0.5f * a * a) * p;
  return SELECT(x < 0.0f, beyond, 1.0f - beyond);
}

/* The x below which the share lies. */
INLINE REAL gaussian_offset(REAL share) {
  const REAL y = 2.0f * share - 1.0f, w = -LOG(MAX((1.0f - y) * (1.0f + y), (REAL)(1e-4f)));
  REAL p = NUMBER(-2.314455472e-8);
  p = p * w + 1.009347009e-6f;
  p = p * w - 1.763662046e-5f;
  p = p * w + 1.452157174e-4f;
  p = p * w - 3.463730284e-4f;
  p = p * w - 3.123544168e-3f;
  p = p * w + 1.624943954e-2f;
  p = p * w + 3.281264584e-1f;
  p = p * w + 1.253314410f;
  return p * y;
}

INLINE REAL tent_share(REAL x) {
  const REAL rest = 1.0f - ABS(x), beyond = 0.5f * rest * rest;
  return SELECT(x < 0.0f, beyond, 1.0f - beyond);
}

/* An offset of a pixel that lies between the film's edges, `low` and `high` from its centre. */
INLINE REAL offset_on_film(int filter, float size, REAL low, REAL high, REAL u) {
  const float reach = filter == FILTER_GAUSSIAN ? GAUSSIAN_REACH : 1.0f;
  const REAL from = MAX(low * (1.0f / size), (REAL)(-reach)), to = MIN(high * (1.0f / size), (REAL)(reach));
  REAL x;
  if (filter == FILTER_GAUSSIAN) {
    const REAL least = gaussian_share(from);
    x = gaussian_offset(least + u * (gaussian_share(to) - least));
  } else {
    const REAL least = tent_share(from);
    x = tent_offset(least + u * (tent_share(to) - least));
  }
  return size * clamp(x, from, to);
}

/* Pixels whose filter reaches over an edge of the film take what lies on it alone, as in Mitsuba with sample_border false: the
 * filter is cut there, and its weights are those of the rest. */
INLINE void stay_on_film(__global const CameraRecord* camera, INT column, INT row, REAL u, REAL v, REAL* x, REAL* y) {
  const REAL left = -0.5f - CAST_REAL(column), top = -0.5f - CAST_REAL(row);
  const REAL right = left + (float)camera->crop_width, bottom = top + (float)camera->crop_height;
  const REAL reach = (REAL)(camera->filter_reach);
  const MASK over = (left > -reach) | (right < reach) | (top > -reach) | (bottom < reach);
  if (!ANY(over)) return;
  *x = SELECT(over, offset_on_film(camera->filter, camera->filter_size, left, right, u), *x);
  *y = SELECT(over, offset_on_film(camera->filter, camera->filter_size, top, bottom, v), *y);
}
#endif

#endif
