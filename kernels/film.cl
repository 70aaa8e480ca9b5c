/* Film: sums of a pixel's samples and of their squares, in the order of the samples, carried on from launch to launch. */

/* a + b as a rounded sum and its error, exactly (Knuth's TwoSum). */
inline void add_exactly(float* sum, float* error, float b) {
  float a = *sum, s = a + b, bb = s - a;
  *error += (a - (s - bb)) + (b - bb);
  *sum = s;
}

/* samples: [pixel][sample][channel]; sums: [pixel][channel][sum, its error, sum of squares, its error].
 * The squares are rounded once each, which is below the noise they measure. */
__kernel void accumulate(__global const float* restrict samples, int samples_a_pixel, int channels, int pixels,
                         __global float* restrict sums) {
  int pixel = get_global_id(0);
  if (pixel >= pixels) return;
  for (int c = 0; c < channels; ++c) {
    __global float* out = sums + 4 * ((size_t)pixel * channels + c);
    float sum = out[0], error = out[1], square = out[2], square_error = out[3];
    for (int s = 0; s < samples_a_pixel; ++s) {
      float x = samples[((size_t)pixel * samples_a_pixel + s) * channels + c];
      add_exactly(&sum, &error, x);
      add_exactly(&square, &square_error, x * x);
    }
    out[0] = sum;
    out[1] = error;
    out[2] = square;
    out[3] = square_error;
  }
}
