/* Mitsuba's `checkerboard`: squares half a unit of u and v wide, color0 where both coordinates are in the first half of
 * a unit or both in the second, color1 elsewhere. A border belongs to the first half, a whole number too.
 * Tests: tests/model/checkerboard_test.cpp */
#ifndef ITN_CHECKERBOARD_H
#define ITN_CHECKERBOARD_H

#define CHECKERBOARD_COLOURS(COLOUR) COLOUR(color0, TEXTURE_COLOUR, 0.4) COLOUR(color1, TEXTURE_COLOUR, 0.2)
#define CHECKERBOARD_TRAITS 0

#ifdef __OPENCL_VERSION__
static inline int checkerboard_value(__global const TextureRecord* t, __global const float* texels,
                                     __global const float* number, TexturePlace at, float rgb[3]) {
  const int colour = (at.u - floor(at.u) > 0.5f) == (at.v - floor(at.v) > 0.5f) ? 1 : 2;
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] = number[colour * t->numbers + c];
  return colour;
}

static inline int checkerboard_texels(__global const TextureRecord* t, __global const float* texels, TexturePlace at,
                                      int which[4], float weight[4]) {
  return 0;
}
#endif

#endif
