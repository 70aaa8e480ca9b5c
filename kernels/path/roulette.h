/* Russian roulette. */
#ifndef ITN_ROULETTE_H
#define ITN_ROULETTE_H
#include "path/launch.h"

#define FAINT 0.5f               /* throughput below which paths may end */
#define PATIENCE 512             /* vertices after which paths may end that lose nothing, until */
#define HEAVY 16.0f              /* their throughput has been raised to this */
#define LASTS_IN_MEDIA 1.0f      /* survival of heavy paths */
#define LASTS_AT_SURFACES 0.999f /* some paths never leave smooth glass, or a white room without a window */

/* Russian roulette: from rr_depth on, paths whose largest throughput is below FAINT survive with throughput over FAINT,
 * which raises it to FAINT, never more. Brighter ones go on. But after PATIENCE vertices they survive with 0.95, as in
 * Mitsuba, until their throughput has been raised to HEAVY: for ever it would end all that take long, and raise the rest
 * without bound. From there on they survive with `lasts`. Returns who dies; survivors' throughput is raised in place. */
INLINE MASK roulette(const Launch* launch, __global const JobRecord* job, INT depth, REAL u, MASK active, REAL largest,
                     float lasts, REAL throughput[]) {
  const float tired = job->is_stuck ? lasts : 0.95f; /* of paths that go nowhere none may end without being counted */
  const REAL longest = SELECT(depth <= PATIENCE, (REAL)(1.0f), SELECT(largest < HEAVY, (REAL)tired, (REAL)lasts));
  REAL survival = MIN(largest * (1.0f / FAINT), longest);
  MASK plays = active & (depth > job->rr_depth);
  MASK dies = (active & (largest <= 0.0f)) | (plays & (u >= survival));
  REAL raise = SELECT(plays & !dies, 1.0f / MAX(survival, (REAL)1e-20f), 1.0f);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) throughput[c] *= raise;
  const MASK ends = active & !dies & (depth >= job->max_depth);
  if (job->is_endless && ANY(ends)) atomic_add(launch->endless, popcount(lane_bits(ends)));
  return dies | ends;
}

#endif
