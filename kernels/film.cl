/* Film: sums of a pixel's samples and of their squares, in the order of the samples, carried on from launch to launch. */

/* *sum + *error = *sum + *error + b, with what rounding takes from the sum kept in the error (Knuth's TwoSum). */
inline void add_exactly(float* sum, float* error, float b) {
  float a = *sum, s = a + b, part = s - a;
  *error += (a - (s - part)) + (b - part);
  *sum = s;
}

/* samples: from first_sample on [pixel][sample][image][channel]; sums: [pixel][image][channel][sum, its error, sum of
 * squares, its error], which start at 0 if fresh.
 * luminance: one channel, the luminance of three (Rec. 709). Squares are rounded once each, below the noise they measure. */
__kernel void accumulate(__global const float* restrict samples, uint first_sample, int samples_a_pixel, int images,
                         int channels, int luminance, int first_pixel, int pixels, int fresh,
                         __global float* restrict sums) {
  int pixel = get_global_id(0);
  if (pixel >= pixels) return;
  const int step = images * channels;
  __global const float* in = samples + ((size_t)first_sample + (size_t)pixel * samples_a_pixel) * step;
  const int out_channels = luminance ? 1 : channels;
  for (int v = 0; v < images * out_channels; ++v) {
    __global float* out = sums + 4 * ((size_t)(first_pixel + pixel) * images * out_channels + v);
    float sum = fresh ? 0.0f : out[0], error = fresh ? 0.0f : out[1];
    float square = fresh ? 0.0f : out[2], square_error = fresh ? 0.0f : out[3];
    __global const float* value = in + (luminance ? 3 * v : v);
    for (int s = 0; s < samples_a_pixel; ++s, value += step) {
      float x = luminance ? 0.212671f * value[0] + 0.715160f * value[1] + 0.072169f * value[2] : value[0];
      add_exactly(&sum, &error, x);
      add_exactly(&square, &square_error, x * x);
    }
    out[0] = sum;
    out[1] = error;
    out[2] = square;
    out[3] = square_error;
  }
}
