/* Functions whose loops go up to one of their arguments, a constant wherever they are called. On the device they have no code of
 * their own, in which loops would stay rolled. */
#ifndef ITN_PHASE_SIZED_H
#define ITN_PHASE_SIZED_H
#include "shared/portable.h"

#ifdef __OPENCL_VERSION__
#define SIZED_MODEL static __attribute__((always_inline)) inline REAL
#define SIZED_MODEL_VOID static __attribute__((always_inline)) inline void
#else
#define SIZED_MODEL MODEL
#define SIZED_MODEL_VOID MODEL_VOID
#endif

#endif
