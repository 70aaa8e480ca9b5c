/* Mitsuba's `bitmap`: nearest or bilinear, texel centres at half integers, row 0 at v = 0.
 * Tests: tests/stage/diffuse_test.cpp */
#ifndef ITN_BITMAP_H
#define ITN_BITMAP_H

#define BITMAP_COLOURS(COLOUR)

#ifdef __OPENCL_VERSION__
static inline int wrap_texel(int i, int size, int wrap) {
  if (i >= 0 && i < size) return i; /* most are: divisions are slow */
  if (wrap == TEXTURE_CLAMP) return clamp(i, 0, size - 1);
  int period = wrap == TEXTURE_MIRROR ? 2 * size : size;
  i = i % period;
  if (i < 0) i += period;
  return i < size ? i : period - 1 - i;
}

static inline void texel(__global const TextureRecord* t, __global const float* texels, int x, int y, float weight,
                         float rgb[3]) {
  __global const float* p =
      texels + t->offset + 3 * (wrap_texel(y, t->height, t->wrap) * t->width + wrap_texel(x, t->width, t->wrap));
  UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] += weight * p[c];
}

/* The texels that a place shows, by their numbers, and their weights. Returns how many: four, or the nearest alone. */
static inline int bitmap_texels(__global const TextureRecord* t, float u, float v, int which[4], float weight[4]) {
  const float x = u * t->width, y = v * t->height;
  if (t->nearest) {
    which[0] = wrap_texel((int)floor(y), t->height, t->wrap) * t->width + wrap_texel((int)floor(x), t->width, t->wrap);
    weight[0] = 1.0f;
    return 1;
  }
  const float left = floor(x - 0.5f), top = floor(y - 0.5f), a = x - 0.5f - left, b = y - 0.5f - top;
  UNROLL_FOR(int k = 0; k < 4; ++k) {
    const int right = k & 1, below = k >> 1;
    which[k] =
        wrap_texel((int)top + below, t->height, t->wrap) * t->width + wrap_texel((int)left + right, t->width, t->wrap);
    weight[k] = (right ? a : 1 - a) * (below ? b : 1 - b);
  }
  return 4;
}

static inline int bitmap_value(__global const TextureRecord* t, __global const float* texels,
                               __global const float* number, TexturePlace at, float rgb[3]) {
  int which[4];
  float weight[4];
  const int shown = bitmap_texels(t, at.u, at.v, which, weight);
  rgb[0] = rgb[1] = rgb[2] = 0.0f;
  UNROLL_FOR(int k = 0; k < 4; ++k) {
    if (k >= shown) continue;
    __global const float* p = texels + t->offset + 3 * which[k];
    UNROLL_FOR(int c = 0; c < 3; ++c) rgb[c] += weight[k] * p[c];
  }
  return 0;
}

/* d value / d u and d value / d v of the first channel, after to_uv. */
static inline void bitmap_slopes(__global const TextureRecord* t, __global const float* texels, float u, float v,
                                 float slopes[2]) {
  slopes[0] = slopes[1] = 0.0f;
  if (t->nearest) return;
  const float x = u * t->width, y = v * t->height;
  const float left = floor(x - 0.5f), top = floor(y - 0.5f), a = x - 0.5f - left, b = y - 0.5f - top;
  float along_x[3] = {0.0f, 0.0f, 0.0f}, along_y[3] = {0.0f, 0.0f, 0.0f};
  texel(t, texels, (int)left, (int)top, b - 1, along_x);
  texel(t, texels, (int)left + 1, (int)top, 1 - b, along_x);
  texel(t, texels, (int)left, (int)top + 1, -b, along_x);
  texel(t, texels, (int)left + 1, (int)top + 1, b, along_x);
  texel(t, texels, (int)left, (int)top, a - 1, along_y);
  texel(t, texels, (int)left + 1, (int)top, -a, along_y);
  texel(t, texels, (int)left, (int)top + 1, 1 - a, along_y);
  texel(t, texels, (int)left + 1, (int)top + 1, a, along_y);
  slopes[0] = t->width * along_x[0];
  slopes[1] = t->height * along_y[0];
}
#endif

#endif
