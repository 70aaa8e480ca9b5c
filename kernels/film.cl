/* Film: sums of a pixel's samples and of their squares, in their order, carried on from launch to launch. */
#include "lib/vector.h"

/* A sum of three floats, each at most half a unit in the last place of the one before: 72 bits. Two would do for the noise
 * of 2^31 samples, but what is rounded off equal samples adds up. */
typedef struct {
  REAL high, middle, low;
} Sum;

/* *a + *b stays what it is, with what *a cannot hold in *b (Knuth's TwoSum). */
INLINE void carry(REAL* a, REAL* b) {
  const REAL sum = *a + *b, part = sum - *a;
  *b = (*a - (sum - part)) + (*b - part);
  *a = sum;
}

INLINE void add_exactly(Sum* s, REAL x) {
  carry(&s->high, &x);
  carry(&s->middle, &x);
  s->low += x;
  carry(&s->high, &s->middle);
  carry(&s->middle, &s->low);
}

/* x^2 with what its rounding takes off (Dekker 1971), which may be more than the noise of a pixel: the products of halves of
 * the digits are exact. */
INLINE void add_square(Sum* s, REAL x) {
  const REAL upper = AS_REAL(AS_INT(x) & (INT)(0xfffff000)), lower = x - upper;
  const REAL of_upper = upper * upper, mixed = 2.0f * upper * lower, of_lower = lower * lower;
  REAL square = x * x, rest = of_upper - square;
  rest += mixed;
  rest += of_lower;
  carry(&s->high, &square);
  carry(&s->middle, &square);
  carry(&s->middle, &rest);
  s->low += square + rest;
  carry(&s->high, &s->middle);
  carry(&s->middle, &s->low);
}

INLINE Sum load_sum(__global const float* sums, INT at) {
  Sum s;
  s.high = GATHER(sums, at);
  s.middle = GATHER(sums, at + 1);
  s.low = GATHER(sums, at + 2);
  return s;
}

INLINE void store_sum(__global float* sums, INT at, const Sum* s) {
  SCATTER(sums, at, s->high);
  SCATTER(sums, at + 1, s->middle);
  SCATTER(sums, at + 2, s->low);
}

/* samples: from first_sample on [pixel][sample][image][channel], `step` floats a sample; sums:
 * [pixel][image][channel][sum, sum of squares][high, middle, low], which start at 0 if fresh. A lane sums one value of one pixel:
 * every addition waits for the last. luminance: one channel, the luminance of three (Rec. 709). */
__kernel void accumulate(__global const float* restrict samples, uint first_sample, int samples_a_pixel, int step,
                         int images, int channels, int luminance, int first_pixel, int pixels, int fresh,
                         __global float* restrict sums) {
  const int values = images * (luminance ? 1 : channels), all = pixels * values;
  const int first = get_global_id(0) * WIDTH;
  if (first >= all) return;
  const INT value = min(first + LANE_INDEX, (INT)(all - 1)), pixel = value / values;
  INT in = ((int)first_sample + pixel * samples_a_pixel) * step + (value - pixel * values) * (luminance ? 3 : 1);
  __global float* out = sums + 6 * (size_t)first_pixel * values;
  const Sum nothing = {(REAL)(0.0f), (REAL)(0.0f), (REAL)(0.0f)};
  Sum sum = fresh ? nothing : load_sum(out, 6 * value), squares = fresh ? nothing : load_sum(out, 6 * value + 3);
  for (int s = 0; s < samples_a_pixel; ++s, in += step) {
    REAL x = GATHER(samples, in);
    if (luminance) x = 0.212671f * x + 0.715160f * GATHER(samples, in + 1) + 0.072169f * GATHER(samples, in + 2);
    add_exactly(&sum, x);
    add_square(&squares, x);
  }
  store_sum(out, 6 * value, &sum);
  store_sum(out, 6 * value + 3, &squares);
}
