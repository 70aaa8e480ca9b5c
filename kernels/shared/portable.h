/* The common subset of OpenCL C 1.2 and C++ in which model formulas are written once.
 *
 * A formula is a function over REAL that uses + - * /, comparisons, SELECT, SQRT, EXP, LOG, ABS, MIN, MAX; samplers
 * also use sin_cos_2pi. It compiles as
 *   OpenCL C, WIDTH 1        REAL = float        GPUs and regression tests
 *   OpenCL C, WIDTH 4, 8, 16 REAL = floatN       CPUs: N paths a work-item
 *   C++                      REAL = any scalar   double (reference), dual numbers, a recorder (derivatives)
 *
 * Comparisons give a MASK. On the device a vector comparison is 0 / -1 and a scalar one 0 / 1: combine masks with
 * & | and !, never with ~, && or ||, and use them through SELECT only. */
#ifndef ITN_PORTABLE_H
#define ITN_PORTABLE_H

#ifdef __OPENCL_VERSION__

/* INLINE: a function of the device. PoCL reads a plain `inline` as GNU C89 does; elsewhere it is C99's, which leaves no
 * function to call. PoCL would inline all that is static and called once: twice the code, and up to twice as long to build.
 *
 * PoCL fuses a * b + c where they stand in one expression, so that a formula has the same bits in every program. Other
 * compilers fuse what they happen to see side by side: an image would depend on which derivatives come with it. */
#ifdef POCL_DEVICE_ADDRESS_BITS
#define INLINE inline
#else
#define INLINE static inline
#pragma OPENCL FP_CONTRACT OFF
#endif

/* Before a short loop: PoCL unrolls none by itself, and leaves arrays in memory that would fit into registers. */
#define UNROLL _Pragma("unroll")
#define UNROLL_FOR UNROLL for
#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#if WIDTH == 1
#define REAL_NAME float
#define INT_NAME int
#define UINT_NAME uint
#else
#define REAL_NAME JOIN(float, WIDTH)
#define INT_NAME JOIN(int, WIDTH)
#define UINT_NAME JOIN(uint, WIDTH)
#endif
typedef REAL_NAME REAL;
typedef INT_NAME INT;
typedef UINT_NAME UINT;
typedef INT MASK;
typedef struct {
  REAL x, y, z;
} REAL3;

#define MODEL static inline REAL
#define MODEL3 static inline REAL3
#define MODEL_VOID static inline void
#define NUMBER(value) ((REAL)(float)(value))
/* Conversions (towards zero) and reinterpretations, lane by lane. */
#define CAST_REAL JOIN(convert_, REAL_NAME)
#define CAST_INT JOIN(convert_, INT_NAME)
#define AS_REAL JOIN(as_, REAL_NAME)
#define AS_INT JOIN(as_, INT_NAME)
#define AS_UINT JOIN(as_, UINT_NAME)
/* (mask) ? yes : no, lane by lane */
#define SELECT(mask, yes, no) ((mask) ? (REAL)(yes) : (REAL)(no))
#define SQRT(x) sqrt(x)
#define ABS(x) fabs(x)
/* The instruction of every vector unit; unlike fmin and fmax, a NaN in the first operand gives the second. */
#define MIN(a, b) real_min(a, b)
#define MAX(a, b) real_max(a, b)
INLINE REAL real_min(REAL a, REAL b) { return a < b ? a : b; }
INLINE REAL real_max(REAL a, REAL b) { return a > b ? a : b; }
#define LOG(x) real_log(x)
#define EXP(x) real_exp(x)
#include "shared/elementary.h"

#else

#include <cmath>

template <class Real>
struct Vector3 {
  Real x, y, z;
};
#define UNROLL
#define UNROLL_FOR for
#define REAL3 Vector3<REAL>
#define MODEL           \
  template <class REAL> \
  inline REAL
#define MODEL3          \
  template <class REAL> \
  inline Vector3<REAL>
#define MODEL_VOID      \
  template <class REAL> \
  inline void
#define MASK auto
#define NUMBER(value) REAL(value)

namespace portable {
template <class Real>
Real choose(bool mask, const Real& yes, const Real& no) {
  return mask ? yes : no;
}
template <class Real>
Real smaller(const Real& a, const Real& b) {
  return choose(a < b, a, b);
}
template <class Real>
Real larger(const Real& a, const Real& b) {
  return choose(a > b, a, b);
}
using std::cos;
using std::exp;
using std::fabs;
using std::log;
using std::sin;
using std::sqrt;
template <class Real>
void sin_cos_2pi(const Real& x, Real* s, Real* c) {
  *s = sin(Real(6.28318530717958647693) * x);
  *c = cos(Real(6.28318530717958647693) * x);
}
}  // namespace portable
#define SELECT(mask, yes, no) choose(mask, REAL(yes), REAL(no))
#define SQRT(x) sqrt(x)
#define ABS(x) fabs(x)
#define MIN(a, b) smaller(REAL(a), REAL(b))
#define MAX(a, b) larger(REAL(a), REAL(b))
#define LOG(x) log(x)
#define EXP(x) exp(x)
using namespace portable;  // formulas call these unqualified so that recorded and dual scalars bring their own by ADL

#endif

#define PI_ 3.14159265358979323846

/* Vectors: three REALs. */
MODEL3 make3(REAL x, REAL y, REAL z) {
  REAL3 r;
  r.x = x;
  r.y = y;
  r.z = z;
  return r;
}
MODEL dot3(REAL3 a, REAL3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
MODEL3 add3(REAL3 a, REAL3 b) { return make3(a.x + b.x, a.y + b.y, a.z + b.z); }
MODEL3 sub3(REAL3 a, REAL3 b) { return make3(a.x - b.x, a.y - b.y, a.z - b.z); }
MODEL3 scale3(REAL3 a, REAL s) { return make3(a.x * s, a.y * s, a.z * s); }
MODEL3 cross3(REAL3 a, REAL3 b) { return make3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x); }

#endif
