/* Mitsuba's texture `volume`: what a grid of voxels has at the place of the surface in the world.
 *
 * In texels, at the record's offset: twelve floats, the rows of an affine map from the world to voxels, of which voxel i
 * reaches from i to i + 1; the number of voxels along z (int); then the voxels, rgb, x fastest. The record's width and
 * height are those along x and y.
 * Tests: tests/transport/mitsuba_test.cpp, tests/scene/material_test.cpp */
#ifndef ITN_VOLUME_TEXTURE_H
#define ITN_VOLUME_TEXTURE_H

#define VOLUME_COLOURS(COLOUR)
#define VOLUME_TRAITS TEXTURE_IN_SPACE
#define VOLUME_TEXTURE_HEAD 13

#ifdef __OPENCL_VERSION__
/* Finds the two voxels between which a place lies along an axis of n, and returns the share of the second. */
static inline float volume_voxels(float x, int n, int wrap, int nearest, int which[2]) {
  const float below = floor(nearest ? x : x - 0.5f);
  which[0] = wrap_texel((int)below, n, wrap);
  which[1] = nearest ? which[0] : wrap_texel((int)below + 1, n, wrap);
  return nearest ? 0.0f : x - 0.5f - below;
}

static inline int volume_value(__global const TextureRecord* t, __global const float* texels,
                               __global const float* number, TexturePlace at, float rgb[3]) {
#if HAS_VOLUME_TEXTURES
  __global const float* map = texels + t->offset;
  __global const float* voxels = map + VOLUME_TEXTURE_HEAD;
  const int size[3] = {t->width, t->height, as_int(map[12])};
  int which[3][2];
  float share[3];
  UNROLL_FOR(int k = 0; k < 3; ++k)
    share[k] = volume_voxels(map[4 * k] * at.x + map[4 * k + 1] * at.y + map[4 * k + 2] * at.z + map[4 * k + 3],
                             size[k], t->wrap, t->nearest, which[k]);
  rgb[0] = rgb[1] = rgb[2] = 0.0f;
  UNROLL_FOR(int k = 0; k < 8; ++k) {
    const int i = k & 1, j = k >> 1 & 1, l = k >> 2;
    const float weight = (i ? share[0] : 1 - share[0]) * (j ? share[1] : 1 - share[1]) * (l ? share[2] : 1 - share[2]);
    __global const float* p = voxels + 3 * ((which[2][l] * size[1] + which[1][j]) * size[0] + which[0][i]);
    UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] += weight * p[c];
  }
#endif
  return 0;
}

/* Nobody differentiates by them. */
static inline int volume_texels(__global const TextureRecord* t, __global const float* texels, TexturePlace at,
                                int which[4], float weight[4]) {
  return 0;
}
#endif

#endif
