/* Film: sums of a pixel's samples and of their squares, in their order, carried on from launch to launch. */
#include "shared/vector.h"

/* *sum + *error = *sum + *error + b, with what rounding takes from the sum kept in the error (Knuth's TwoSum). */
INLINE void add_exactly(REAL* sum, REAL* error, REAL b) {
  REAL a = *sum, s = a + b, part = s - a;
  *error += (a - (s - part)) + (b - part);
  *sum = s;
}

/* samples: from first_sample on [pixel][sample][image][channel], `step` floats a sample; sums:
 * [pixel][image][channel][sum, its error, sum of squares, its error], which start at 0 if fresh. A lane sums one value
 * of one pixel: every addition waits for the last. luminance: one channel, the luminance of three (Rec. 709). Squares
 * are rounded once each, below the noise they measure. */
__kernel void accumulate(__global const float* restrict samples, uint first_sample, int samples_a_pixel, int step,
                         int images, int channels, int luminance, int first_pixel, int pixels, int fresh,
                         __global float* restrict sums) {
  const int values = images * (luminance ? 1 : channels), all = pixels * values;
  const int first = get_global_id(0) * WIDTH;
  if (first >= all) return;
  const INT value = min(first + LANE_INDEX, (INT)(all - 1)), pixel = value / values;
  INT in = ((int)first_sample + pixel * samples_a_pixel) * step + (value - pixel * values) * (luminance ? 3 : 1);
  __global float* out = sums + 4 * (size_t)first_pixel * values;
  REAL sum = (REAL)(0.0f), error = sum, square = sum, square_error = sum;
  if (!fresh) {
    sum = GATHER(out, 4 * value);
    error = GATHER(out, 4 * value + 1);
    square = GATHER(out, 4 * value + 2);
    square_error = GATHER(out, 4 * value + 3);
  }
  for (int s = 0; s < samples_a_pixel; ++s, in += step) {
    REAL x = GATHER(samples, in);
    if (luminance) x = 0.212671f * x + 0.715160f * GATHER(samples, in + 1) + 0.072169f * GATHER(samples, in + 2);
    add_exactly(&sum, &error, x);
    add_exactly(&square, &square_error, x * x);
  }
  SCATTER(out, 4 * value, sum);
  SCATTER(out, 4 * value + 1, error);
  SCATTER(out, 4 * value + 2, square);
  SCATTER(out, 4 * value + 3, square_error);
}
