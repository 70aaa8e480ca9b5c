/* Mitsuba's `bitmap`: nearest or bilinear, texel centres at half integers, row 0 at v = 0.
 * Tests: tests/stage/diffuse_test.cpp */
#ifndef ITN_BITMAP_H
#define ITN_BITMAP_H

#define BITMAP_COLOURS(COLOUR)
#define BITMAP_TRAITS 0

#ifdef __OPENCL_VERSION__
static inline int wrap_texel(int i, int size, int wrap) {
  if (i >= 0 && i < size) return i; /* most are: divisions are slow */
  if (wrap == TEXTURE_CLAMP) return clamp(i, 0, size - 1);
  int period = wrap == TEXTURE_MIRROR ? 2 * size : size;
  i = i % period;
  if (i < 0) i += period;
  return i < size ? i : period - 1 - i;
}

/* The texels around a place, by their numbers: four, or the nearest alone. a, b: how far to the right and below it is
 * between them. */
typedef struct {
  int shown, which[4];
  float a, b;
} BitmapPlace;

static inline BitmapPlace bitmap_place(__global const TextureRecord* t, float u, float v) {
  BitmapPlace p;
  const float x = u * t->width, y = v * t->height;
  p.shown = t->nearest ? 1 : 4;
  p.a = p.b = 0.0f;
  if (t->nearest) {
    p.which[0] =
        wrap_texel((int)floor(y), t->height, t->wrap) * t->width + wrap_texel((int)floor(x), t->width, t->wrap);
    return p;
  }
  const float left = floor(x - 0.5f), top = floor(y - 0.5f);
  p.a = x - 0.5f - left;
  p.b = y - 0.5f - top;
  UNROLL_FOR(int k = 0; k < 4; ++k)
    p.which[k] = wrap_texel((int)top + (k >> 1), t->height, t->wrap) * t->width +
                 wrap_texel((int)left + (k & 1), t->width, t->wrap);
  return p;
}

static inline int bitmap_texels(__global const TextureRecord* t, __global const float* texels, TexturePlace at,
                                int which[4], float weight[4]) {
  const BitmapPlace p = bitmap_place(t, at.u, at.v);
  UNROLL_FOR(int k = 0; k < 4; ++k) {
    if (k >= p.shown) continue;
    which[k] = p.which[k];
    weight[k] = t->nearest ? 1.0f : (k & 1 ? p.a : 1 - p.a) * (k >> 1 ? p.b : 1 - p.b);
  }
  return p.shown;
}

/* The same of d value / d u and d value / d v, after to_uv; of nearest texels: none. */
static inline int bitmap_slope_texels(__global const TextureRecord* t, float u, float v, int which[4], float along_u[4],
                                      float along_v[4]) {
  if (t->nearest) return 0;
  const BitmapPlace p = bitmap_place(t, u, v);
  UNROLL_FOR(int k = 0; k < 4; ++k) {
    which[k] = p.which[k];
    along_u[k] = (k & 1 ? 1.0f : -1.0f) * (k >> 1 ? p.b : 1 - p.b);
    along_v[k] = (k >> 1 ? 1.0f : -1.0f) * (k & 1 ? p.a : 1 - p.a);
  }
  return 4;
}

static inline int bitmap_value(__global const TextureRecord* t, __global const float* texels,
                               __global const float* number, TexturePlace at, float rgb[3]) {
  int which[4];
  float weight[4];
  const int shown = bitmap_texels(t, texels, at, which, weight);
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
  int which[4];
  float along_u[4], along_v[4];
  slopes[0] = slopes[1] = 0.0f;
  if (bitmap_slope_texels(t, u, v, which, along_u, along_v) == 0) return;
  UNROLL_FOR(int k = 0; k < 4; ++k) {
    const float height = texels[t->offset + 3 * which[k]];
    slopes[0] += along_u[k] * height;
    slopes[1] += along_v[k] * height;
  }
  slopes[0] = t->width * slopes[0];
  slopes[1] = t->height * slopes[1];
}
#endif

#endif
