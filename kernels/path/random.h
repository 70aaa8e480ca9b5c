/* Counter-based random numbers: Philox4x32-10. OpenCL C only.
 *
 * A number is a function of (seed, pixel, sample, event, stream) and of nothing else, so an image does not depend on
 * the order in which paths are worked on, and a path can be replayed. Ten rounds pass every test of TestU01's BigCrush.
 *   Salmon, Moraes, Dror, Shaw 2011, "Parallel random numbers: as easy as 1, 2, 3", doi:10.1145/2063384.2063405 */
#ifndef ITN_RANDOM_H
#define ITN_RANDOM_H
#include "shared/portable.h"

/* 64-bit product of each lane with a constant, as high and low words. Vectors: mul_hi goes lane by lane in PoCL, two
 * products of the even and the odd lanes as 64-bit integers do not (little-endian devices). */
#if WIDTH == 1
INLINE void multiply_wide(UINT a, uint b, UINT* high, UINT* low) {
  *high = mul_hi(a, b);
  *low = a * b;
}
#else
#if WIDTH == 16
#define WIDE_NAME ulong8
#elif WIDTH == 8
#define WIDE_NAME ulong4
#else
#define WIDE_NAME ulong2
#endif
INLINE void multiply_wide(UINT a, uint b, UINT* high, UINT* low) {
  WIDE_NAME pairs = JOIN(as_, WIDE_NAME)(a);
  WIDE_NAME even = (pairs & 0xffffffffUL) * (WIDE_NAME)((ulong)b);
  WIDE_NAME odd = (pairs >> 32) * (WIDE_NAME)((ulong)b);
  *high = AS_UINT((even >> 32) | (odd & 0xffffffff00000000UL));
  *low = a * b;
}
#endif

/* Encrypts the 128-bit counter x[0..3] in place under the key (key0, key1). */
__attribute__((always_inline)) INLINE void philox4x32_10(UINT x[4], uint key0, uint key1) {
  UNROLL_FOR(int i = 0; i < 10; ++i) {
    UINT high0, low0, high1, low1;
    multiply_wide(x[0], 0xD2511F53u, &high0, &low0);
    multiply_wide(x[2], 0xCD9E8D57u, &high1, &low1);
    x[0] = high1 ^ x[1] ^ key0;
    x[1] = low1;
    x[2] = high0 ^ x[3] ^ key1;
    x[3] = low0;
    key0 += 0x9E3779B9u;
    key1 += 0xBB67AE85u;
  }
}

/* 23 bits to (k + 1/2) / 2^23: uniform, at least 2^-24, at most 1 - 2^-24, so that log(u), log(1 - u), u < p with p = 0
 * and u >= p with p = 1 are all safe. */
INLINE REAL uniform_from_bits(UINT bits) { return AS_REAL((bits >> 9) | 0x3f800000u) - 0.99999994039535522f; }

/* Four independent uniform numbers in (0, 1) for an event of a path. stream tells apart uses within one event. */
INLINE void random4(UINT pixel, UINT sample, UINT event, uint stream, uint seed0, uint seed1, REAL u[4]) {
  UINT x[4];
  x[0] = pixel;
  x[1] = sample;
  x[2] = event;
  x[3] = (UINT)(stream);
  philox4x32_10(x, seed0, seed1);
  u[0] = uniform_from_bits(x[0]);
  u[1] = uniform_from_bits(x[1]);
  u[2] = uniform_from_bits(x[2]);
  u[3] = uniform_from_bits(x[3]);
}

#endif
