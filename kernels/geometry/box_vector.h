/* Vectors of BOX_WIDTH floats: one ray against BOX_WIDTH boxes or primitives at a time. Independent of WIDTH. */
#ifndef ITN_BOX_VECTOR_H
#define ITN_BOX_VECTOR_H
#include "shared/vector.h"

#if BOX_WIDTH != 4 && BOX_WIDTH != 8 && BOX_WIDTH != 16
#error "BOX_WIDTH must be 4, 8 or 16"
#endif

typedef JOIN(float, BOX_WIDTH) BoxFloat;
typedef JOIN(int, BOX_WIDTH) BoxInt;
/* Rows of nodes and blocks are aligned (geometry_layout.h, and OpenCL aligns buffers): one load, which vload is not. */
#define LOAD_BOX(p, row) (*(__global const BoxFloat*)((p) + (row)*BOX_WIDTH))
/* The instruction of every vector unit, without fmin's and fmax's care for NaN: with it, a fifth of a whole render. */
INLINE BoxFloat smaller_of(BoxFloat a, BoxFloat b) { return a < b ? a : b; }
INLINE BoxFloat larger_of(BoxFloat a, BoxFloat b) { return a > b ? a : b; }

typedef union {
  BoxFloat v;
  float f[BOX_WIDTH];
} BoxLanes;

/* As lane_bits (shared/vector.h). */
#if BOX_WIDTH == 16 && defined(__AVX512DQ__)
typedef int box_mask __attribute__((vector_size(64)));
INLINE uint box_bits(BoxInt mask) { return (ushort)__builtin_ia32_cvtd2mask512((box_mask)mask); }
#elif BOX_WIDTH == 8 && defined(__AVX512DQ__) && defined(__AVX512VL__)
typedef int box_mask __attribute__((vector_size(32)));
INLINE uint box_bits(BoxInt mask) { return (uchar)__builtin_ia32_cvtd2mask256((box_mask)mask); }
#elif BOX_WIDTH == 8 && defined(__AVX__)
typedef float box_mask __attribute__((vector_size(32)));
INLINE uint box_bits(BoxInt mask) { return (uint)__builtin_ia32_movmskps256((box_mask)as_float8(mask)); }
#elif BOX_WIDTH == 4 && defined(__SSE__)
typedef float box_mask __attribute__((vector_size(16)));
INLINE uint box_bits(BoxInt mask) { return (uint)__builtin_ia32_movmskps((box_mask)as_float4(mask)); }
#else
INLINE uint box_bits(BoxInt mask) {
#if BOX_WIDTH == 16
  const int16 bit = (int16)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768);
  const int8 eight = (mask & bit).lo | (mask & bit).hi;
  const int4 four = eight.lo | eight.hi;
#elif BOX_WIDTH == 8
  const int8 bit = (int8)(1, 2, 4, 8, 16, 32, 64, 128);
  const int4 four = (mask & bit).lo | (mask & bit).hi;
#else
  const int4 four = mask & (int4)(1, 2, 4, 8);
#endif
  const int2 two = four.lo | four.hi;
  return (uint)(two.x | two.y);
}
#endif

#endif
