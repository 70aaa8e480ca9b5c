/* Stage null: an index-matched boundary; the path goes straight on in the medium of the other side. */
#ifndef ITN_STAGE_NULL_H
#define ITN_STAGE_NULL_H
#include "stage/emission.h"

#if HAS_NULL
INLINE void null_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  Surface s = load_surface(launch, job, pool, slots, valid, false);
  gather_emission(launch, job, pool, slots, valid, &s);
  leave_surface(launch, pool, slots, valid, &s, s.direction);
  STORE_INT(pool, PASSED, slots, 1);
}

#endif

#endif
