/* Lanes: what the device needs beside portable.h to run WIDTH paths a work-item. OpenCL C only.
 *
 *   SELECT_INT(mask, yes, no)                         as SELECT, for INT
 *   LANE_INDEX                                        INT 0, 1, ... WIDTH-1
 *   GATHER(p, i), GATHER_INT(p, i)                    p[i] for each lane; p is a __global const float* / int*
 *   SCATTER(p, i, v), SCATTER_INT(p, i, v)            p[i] = v for each lane
 *   lane_bits(mask)                                   uint, bit l set where lane l is
 *   lane_mask(bits)                                   the opposite
 *   ANY(mask)                                         is any lane set?
 *   FOR_EACH_LANE(l, bits) { }                        loops over the set bits
 *   Lanes                                             a union to read and write single lanes: .real .integer .f[l]
 *                                                     .i[l] */
#ifndef ITN_VECTOR_H
#define ITN_VECTOR_H
#include "shared/portable.h"

#define SELECT_INT(mask, yes, no) ((mask) ? (INT)(yes) : (INT)(no))
#if WIDTH == 1
#define LANE_INDEX 0
#define EACH_(p, i) p[i]
#elif WIDTH == 4
#define LANE_INDEX ((int4)(0, 1, 2, 3))
#define EACH_(p, i) p[(i).s0], p[(i).s1], p[(i).s2], p[(i).s3]
#elif WIDTH == 8
#define LANE_INDEX ((int8)(0, 1, 2, 3, 4, 5, 6, 7))
#define EACH_(p, i) p[(i).s0], p[(i).s1], p[(i).s2], p[(i).s3], p[(i).s4], p[(i).s5], p[(i).s6], p[(i).s7]
#elif WIDTH == 16
#define LANE_INDEX ((int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#define EACH_(p, i)                                                                                             \
  p[(i).s0], p[(i).s1], p[(i).s2], p[(i).s3], p[(i).s4], p[(i).s5], p[(i).s6], p[(i).s7], p[(i).s8], p[(i).s9], \
      p[(i).sa], p[(i).sb], p[(i).sc], p[(i).sd], p[(i).se], p[(i).sf]
#else
#error "WIDTH must be 1, 4, 8 or 16"
#endif
/* 64-bit integers, a lane each. */
#if WIDTH == 1
typedef long LONG;
#define CAST_LONG convert_long
#else
typedef JOIN(long, WIDTH) LONG;
#define CAST_LONG JOIN(convert_long, WIDTH)
#endif
typedef union {
  LONG integer;
  long i[WIDTH];
} LongLanes;

typedef union {
  REAL real;
  INT integer;
  UINT unsigned_integer;
  float f[WIDTH];
  int i[WIDTH];
} Lanes;

/* Each lane's own element. AVX-512's instructions halve the code of a scene's program, and with it the time to build it, and
 * render up to 1.3 times as fast as a load or store for each lane (kernels/README.md, "Decisions"). */
#if WIDTH == 16 && defined(__AVX512DQ__)
typedef float FloatVector16 __attribute__((vector_size(64)));
typedef int IntVector16 __attribute__((vector_size(64)));
#define GATHER(p, i)                                                                                        \
  __builtin_astype(                                                                                         \
      __builtin_ia32_gathersiv16sf(__builtin_astype((REAL)(0), FloatVector16), (const void*)(uintptr_t)(p), \
                                   __builtin_astype((INT)(i), IntVector16), 0xffff, sizeof(float)),         \
      REAL)
#define GATHER_INT(p, i)                                                                                              \
  __builtin_astype(__builtin_ia32_gathersiv16si(__builtin_astype((INT)(0), IntVector16), (const void*)(uintptr_t)(p), \
                                                __builtin_astype((INT)(i), IntVector16), 0xffff, sizeof(int)),        \
                   INT)
INLINE void scatter_real(__global float* p, INT index, REAL value) {
  __builtin_ia32_scattersiv16sf((void*)(uintptr_t)p, 0xffff, __builtin_astype(index, IntVector16),
                                __builtin_astype(value, FloatVector16), sizeof(float));
}
#else
#define GATHER(p, i) ((REAL)(EACH_(p, i)))
#define GATHER_INT(p, i) ((INT)(EACH_(p, i)))
INLINE void scatter_real(__global float* p, INT index, REAL value) {
  Lanes at, v;
  at.integer = index;
  v.real = value;
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) p[at.i[l]] = v.f[l];
}
#endif
#define SCATTER(p, index, value) scatter_real(p, index, value)
#define SCATTER_INT(p, index, value) scatter_real((__global float*)(p), index, AS_REAL(value))

/* One bit a lane. The mask instruction of AVX-512 is 15-25 % faster over a whole render than the portable reduction
 * (kernels/README.md, "Decisions"); the builtins exist where the device's compiler says so. */
#if WIDTH == 1
INLINE uint lane_bits(MASK mask) { return mask ? 1u : 0u; }
#elif WIDTH == 16 && defined(__AVX512DQ__)
INLINE uint lane_bits(MASK mask) { return (ushort)__builtin_ia32_cvtd2mask512((IntVector16)mask); }
#elif WIDTH == 8 && defined(__AVX512DQ__) && defined(__AVX512VL__)
typedef int mask_vector8 __attribute__((vector_size(32)));
INLINE uint lane_bits(MASK mask) { return (uchar)__builtin_ia32_cvtd2mask256((mask_vector8)mask); }
#elif WIDTH == 8 && defined(__AVX__)
typedef float mask_vector8 __attribute__((vector_size(32)));
INLINE uint lane_bits(MASK mask) { return (uint)__builtin_ia32_movmskps256((mask_vector8)as_float8(mask)); }
#else
INLINE uint lane_bits(MASK mask) {
  Lanes m;
  m.integer = mask;
  uint bits = 0;
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) bits |= m.i[l] ? 1u << l : 0u;
  return bits;
}
#endif

INLINE MASK lane_mask(uint bits) { return (((INT)((int)bits) >> LANE_INDEX) & 1) != 0; }

INLINE REAL3 select3(MASK mask, REAL3 yes, REAL3 no) {
  return make3(SELECT(mask, yes.x, no.x), SELECT(mask, yes.y, no.y), SELECT(mask, yes.z, no.z));
}

#define ANY(mask) (lane_bits(mask) != 0)
#define LOWEST_BIT(bits) ((int)popcount(~(bits) & ((bits)-1)))
#define FOR_EACH_LANE(l, bits) \
  for (uint left_##l = (bits), l; left_##l && (l = (uint)LOWEST_BIT(left_##l), 1); left_##l &= left_##l - 1)

/* Uniform over the unit sphere. */
INLINE REAL3 uniform_sphere(REAL u0, REAL u1) {
  REAL sine, cosine;
  sin_cos_2pi(u1, &sine, &cosine);
  const REAL r = 2 * sqrt(u0 * (1 - u0));
  return make3(r * cosine, r * sine, 1 - 2 * u0);
}

#endif
