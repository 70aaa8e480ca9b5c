/* Russian roulette. */
#ifndef ITN_ROULETTE_H
#define ITN_ROULETTE_H
#include "path/launch.h"

#define ROULETTE_THRESHOLD 0.5f           /* throughput below which paths may end */
#define ROULETTE_MAX_UNWEIGHTED_DEPTH 512 /* vertices after which paths may end that lose nothing, until */
#define ROULETTE_MAX_THROUGHPUT 16.0f     /* their throughput has been raised to this */
#define ROULETTE_SURVIVAL_IN_MEDIA 1.0f   /* survival of paths with that throughput */
/* Some paths never leave smooth glass, or a white room without a window. */
#define ROULETTE_SURVIVAL_AT_SURFACES 0.999f

/* Russian roulette: from rr_depth on, paths whose largest throughput is below ROULETTE_THRESHOLD survive with
 * throughput over the threshold, which raises it to the threshold, never more. Brighter ones go on. But after
 * ROULETTE_MAX_UNWEIGHTED_DEPTH vertices they survive with 0.95, as in Mitsuba, until their throughput has been raised
 * to ROULETTE_MAX_THROUGHPUT: for ever it would end all that take long, and raise the rest without bound. From there on
 * they survive with `survival_of_raised`. Returns the lanes whose paths die; survivors' throughput is raised in place. */
INLINE MASK roulette(const Launch* launch, __global const JobRecord* job, INT depth, REAL u, MASK active, REAL largest,
                     float survival_of_raised, REAL throughput[]) {
  /* no path that goes nowhere may end without being counted */
  const float survival_of_long = job->is_stuck ? survival_of_raised : 0.95f;
  const REAL most = SELECT(depth <= ROULETTE_MAX_UNWEIGHTED_DEPTH, (REAL)(1.0f),
                           SELECT(largest < ROULETTE_MAX_THROUGHPUT, (REAL)survival_of_long, (REAL)survival_of_raised));
  REAL survival = MIN(largest * (1.0f / ROULETTE_THRESHOLD), most);
  MASK plays = active & (depth > job->rr_depth);
  MASK dies = (active & (largest <= 0.0f)) | (plays & (u >= survival));
  REAL raise = SELECT(plays & !dies, 1.0f / MAX(survival, (REAL)1e-20f), 1.0f);
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) throughput[c] *= raise;
  const MASK ends = active & !dies & (depth >= job->max_depth);
  if (job->is_endless && ANY(ends)) atomic_add(launch->endless, popcount(lane_bits(ends)));
  return dies | ends;
}

#endif
