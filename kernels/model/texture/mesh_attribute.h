/* Mitsuba's `mesh_attribute`: values that a mesh brings along, one a vertex, between which they are interpolated, or
 * one a triangle; times a factor, which the host applies.
 *
 * In texels, at the record's offset: for each shape of the scene the place (int) of its values; of primitive p these
 * are the nine texels from place + 9 p on, rgb at each corner. The corners of all shapes follow the places, and have
 * numbers in that order; the record's width is how many shapes there are.
 * Tests: tests/transport/mitsuba_test.cpp, tests/scene/mesh_file_test.cpp */
#ifndef ITN_MESH_ATTRIBUTE_H
#define ITN_MESH_ATTRIBUTE_H

#define MESH_ATTRIBUTE_COLOURS(COLOUR)
#define MESH_ATTRIBUTE_TRAITS TEXTURE_ON_MESH

#ifdef __OPENCL_VERSION__
static inline int mesh_attribute_value(__global const TextureRecord* t, __global const float* texels,
                                       __global const float* number, TexturePlace at, float rgb[3]) {
#if HAS_ATTRIBUTES
  __global const float* corner = texels + as_int(texels[t->offset + at.shape]) + 9 * at.primitive;
  UNROLL_FOR(int c = 0; c < 3; ++c)
    rgb[c] = (1.0f - at.b1 - at.b2) * corner[c] + at.b1 * corner[3 + c] + at.b2 * corner[6 + c];
#endif
  return 0;
}

static inline int mesh_attribute_texels(__global const TextureRecord* t, __global const float* texels, TexturePlace at,
                                        int which[4], float weight[4]) {
#if HAS_ATTRIBUTES
  const int corner = as_int(texels[t->offset + at.shape]) + 9 * at.primitive - t->offset - t->width;
  UNROLL_FOR(int k = 0; k < 3; ++k) which[k] = corner / 3 + k;
  weight[0] = 1.0f - at.b1 - at.b2;
  weight[1] = at.b1;
  weight[2] = at.b2;
  return 3;
#else
  return 0;
#endif
}
#endif

#endif
