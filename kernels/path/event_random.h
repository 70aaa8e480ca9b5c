/* The random numbers of the events of paths. */
#ifndef ITN_EVENT_RANDOM_H
#define ITN_EVENT_RANDOM_H
#include "path/launch.h"
#include "path/random.h"

/* Random numbers of one event of each path. */
typedef struct {
  UINT pixel, sample;
  INT event;
  uint seed_low, seed_high;
} Random;

__attribute__((always_inline)) INLINE Random load_random(__global const JobRecord* job, const Pool* pool, INT slots) {
  Random r;
  r.pixel = AS_UINT(LOAD_INT(pool, PIXEL, slots));
  r.sample = AS_UINT(LOAD_INT(pool, SAMPLE, slots));
  r.event = LOAD_INT(pool, EVENT, slots);
  r.seed_low = job->seed_low;
  r.seed_high = job->seed_high;
  return r;
}
INLINE void draw(const Random* r, uint stream, REAL u[4]) {
  random4(r->pixel, r->sample, AS_UINT(r->event), stream, r->seed_low, r->seed_high, u);
}

#endif
