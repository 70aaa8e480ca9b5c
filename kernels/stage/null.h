/* Stage null: an index-matched boundary; the path goes straight on in the medium of the other side. */
#ifndef ITN_STAGE_NULL_H
#define ITN_STAGE_NULL_H
#include "stage/surface.h"

#if HAS_NULL
inline void null_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  Surface s = load_surface(launch, job, pool, slots, valid);
  /* A straight line crosses a flat primitive once. Where a body is thinner than the tolerances of trace() the one before the
   * last can be met again: the path has left it behind. */
  const INT skip = LOAD_INT(pool, SKIP, slots), medium = LOAD_INT(pool, MEDIUM, slots);
  const MASK again = (skip >= 0) & (s.primitive == LOAD_INT(pool, BEFORE, slots)) & s.flat;
  leave_surface_into(launch, pool, slots, valid, &s, s.direction,
                     SELECT_INT(again, medium, medium_beyond(&s, medium, s.direction)), skip);
}

#endif

#endif
