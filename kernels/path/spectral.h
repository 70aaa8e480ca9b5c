/* Media whose sigma_t has colours: the hero channel of a path, and the weights of the channels. */
#ifndef ITN_SPECTRAL_H
#define ITN_SPECTRAL_H
#include "path/launch.h"

/* Weight of each throughput channel beyond the throughput: one-pass spectral MIS (balance heuristic over the channels
 * whose sigma_t could have been the hero's), 3 p_c / (p_0 + p_1 + p_2) for the densities p_c of the path with each
 * channel's sigma_t. Paths carry these weights: unlike the densities or their ratios they stay in [0, 3], however long
 * the path. */
#if SPECTRAL
/* An event of the lanes in `mask`, with density `factor` of each channel, over any common one. Should none of the
 * channels be possible, which takes the underflow of the hero's own weight, all weights are 0 and roulette ends the
 * path. */
INLINE void spectral_event(MASK mask, const REAL factor[3], REAL weight[3]) {
  REAL sum = (REAL)(0.0f);
  UNROLL_FOR(int c = 0; c < 3; ++c) sum += weight[c] * factor[c];
  const REAL inverse = 3.0f / MAX(sum, (REAL)(1e-30f));
  UNROLL_FOR(int c = 0; c < 3; ++c) weight[c] = SELECT(mask, weight[c] * factor[c] * inverse, weight[c]);
}
#endif

/* The value of the path's hero channel. */
INLINE REAL of_hero(const REAL of[], INT hero) {
#if SPECTRAL
  return SELECT(hero == 0, of[0], SELECT(hero == 1, of[1], of[2]));
#else
  return of[0];
#endif
}

/* The sigma_t for choices that the weights must not depend on: the same whatever the path's hero channel, or MIS
 * weights would not add up, nor baselines have mean zero. */
INLINE REAL mean_sigma_t(const REAL sigma_t[]) {
#if SPECTRAL
  return (sigma_t[0] + sigma_t[1] + sigma_t[2]) * (1.0f / 3.0f);
#else
  return sigma_t[0];
#endif
}

/* `scale` times the weights of paths between two stages. Without RGB sigma_t these are 1. */
INLINE void channel_weights(const Pool* pool, INT slots, REAL scale, REAL weight[3]) {
#if SPECTRAL
  UNROLL_FOR(int c = 0; c < 3; ++c) weight[c] = LOAD(pool, SPECTRAL_WEIGHT + c, slots) * scale;
#else
  weight[0] = weight[1] = weight[2] = scale;
#endif
}

/* The largest channel with its spectral weight. */
INLINE REAL brightest(const REAL throughput[], const REAL weight[3]) {
#if THROUGHPUT_CHANNELS == 1
  return throughput[0];
#else
  return MAX(throughput[0] * weight[0], MAX(throughput[1] * weight[1], throughput[2] * weight[2]));
#endif
}

#endif
