/* Gradients of many numbers at once: the adjoint of the derivative images. Paths are traced twice. The second time each
 * knows what it gathers in all and how its pixel weighs it (the pixel's adjoint), so that at every event
 *   adjoint * (what it still gathers) * d log f / d number
 * goes straight to the number's sum: nothing is carried for the numbers, however many they are. With baselines
 * (derivative/baseline.h), what is expected of decisions is taken off what it still gathers.
 *
 * Sums must not depend on the order of paths: they are integers, of products rounded once each. The host scales the
 * pixels' adjoints so that a unit is 2^-42 of the sum of |adjoint * radiance| (runtime/render/gradient_renderer.cpp).
 * Derivatives are d log f / d log number, for g times 1 - g^2 (shared/declaration.h): of order 1, so that one scale suits
 * all.
 *
 * By the texels of a texture that stands for a number the gradient is that by the number itself, times the weights with
 * which its texels were looked up; by the heights of a bump map it is that by their slopes, times the weights of these.
 * Of these sums there is one for each texel and channel of the radiance, or component of a normal (TEXEL_CHANNELS), with
 * no sets of pixels; work-items share them unless there is room for their own (OWN_TEXELS). */
#ifndef ITN_ADJOINT_H
#define ITN_ADJOINT_H
#include "path/event_random.h"
#include "path/launch.h"
#include "texture/numbers.h"

#if ADJOINT
enum { STREAM_CHOICE = 0x81 }; /* of a path's first event: which of its flights becomes a probe */
#define FIRST_LIGHT_NUMBER (NUMBERS * RADIANCE_CHANNELS)
#define FIRST_VOXEL_NUMBER (FIRST_LIGHT_NUMBER + LIGHT_NUMBERS * RADIANCE_CHANNELS)
#define SUMS_OF_A_SET (FIRST_VOXEL_NUMBER + VOXEL_SUMS * RADIANCE_CHANNELS + 1) /* the last: what was lost */

/* The slots of models that are summed are known when the program is built. */
__constant SumRecord summed[SUMS + 1] = {SUM_RECORDS};

/* The contributions of one stage's events to the gradient by numbers. */
typedef struct {
  REAL weight[RADIANCE_CHANNELS];   /* adjoint times what is still to be gathered */
  REAL expected[RADIANCE_CHANNELS]; /* adjoint times what was expected of the decision that the event is */
  LONG sum[(SUMS + 1) * RADIANCE_CHANNELS];
  MASK beyond; /* the integers, or not a number */
} AdjointSums;

INLINE AdjointSums no_adjoint_sums(void) {
  AdjointSums p;
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) p.weight[c] = p.expected[c] = (REAL)(0.0f);
  UNROLL_FOR(int i = 0; i < (SUMS + 1) * RADIANCE_CHANNELS; ++i) p.sum[i] = (LONG)(0);
  p.beyond = (MASK)(0);
  return p;
}

INLINE AdjointSums adjoint_sums(const REAL weight[]) {
  AdjointSums p = no_adjoint_sums();
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) p.weight[c] = weight[c];
  return p;
}

/* Weighs scores by what the path gathers from here on, less roulette's baselines from here on. baseline: those so
 * far, a throughput channel each */
INLINE void weigh_by_rest(AdjointSums* p, __global const JobRecord* job, const Pool* pool, INT slots,
                          const REAL baseline[]) {
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    REAL rest = LOAD(pool, TOTAL + c, slots) - LOAD(pool, RADIANCE + c, slots);
#if BASELINES
    const int t = THROUGHPUT_CHANNELS == 1 ? 0 : c;
    rest -= job->future_tint[c] * (LOAD(pool, TOTAL_BASELINE + t, slots) - baseline[t]);
#endif
    p->weight[c] = LOAD(pool, PIXEL_ADJOINT + c, slots) * rest;
  }
}

/* beyond: set where the product is beyond the integers, or not a number */
INLINE LONG rounded(REAL x, MASK* beyond) {
  const MASK fits = ABS(x) < 4e18f;
  *beyond = *beyond | !fits;
  return CAST_LONG(SELECT(fits, rint(x), 0.0f));
}

/* d: by the coordinate of summed[k]'s number, in a channel of the radiance */
INLINE void add_product(AdjointSums* p, int k, int channel, REAL d, REAL weight) {
  p->sum[k * RADIANCE_CHANNELS + channel] += rounded(d * weight, &p->beyond);
}

/* Is summed[k] of the model, and summed in this channel of the radiance? */
INLINE bool is_summed(int k, int model, int channel) {
  const int own = summed[k].channel;
  return summed[k].model == model && ((own < 0) | (THROUGHPUT_CHANNELS == 1) | (own == channel));
}

/* To a sum that work-items share: where there are no atomics of 64 bits, carries arrive once each, in whatever order. */
#ifdef cl_khr_int64_base_atomics
#pragma OPENCL EXTENSION cl_khr_int64_base_atomics : enable
INLINE void add_shared(__global uint* sum, long x) { atom_add((volatile __global long*)sum, x); }
#else
INLINE void add_shared(__global uint* sum, long x) {
  const uint low = (uint)as_ulong(x), high = (uint)(as_ulong(x) >> 32), before = atomic_add(sum, low);
  const uint rest = high + (before + low < low ? 1u : 0u);
  if (rest) atomic_add(sum + 1, rest);
}
#endif

INLINE void add_to_gradient(const Launch* launch, int number, long x) {
  __global uint* sum = launch->gradient + 2 * number;
#if FUSED
  *(__global long*)sum += x;
#else
  add_shared(sum, x);
#endif
}

/* Products that no integer could hold: counted in the first set. */
INLINE void add_lost(const Launch* launch, MASK mask) {
  const uint lost = lane_bits(mask);
  if (lost) add_to_gradient(launch, SUMS_OF_A_SET - 1, popcount(lost));
}

/* The set of each path's pixel: neighbours are in different ones (Knuth's multiplicative hash). */
INLINE INT gradient_set(__global const JobRecord* job, const Pool* pool, INT slots) {
  const UINT hash = AS_UINT(LOAD_INT(pool, PIXEL, slots)) * 0x9E3779B1u;
  return job->first_set + (AS_INT(hash >> 24) & job->set_mask);
}

#if TEXEL_SUMS
/* To the sum of one texel. */
INLINE void add_to_texel(const Launch* launch, int texel, int channel, long x) {
  __global uint* sum = launch->texel_gradient + ((size_t)texel * TEXEL_CHANNELS + channel) * 2;
#if OWN_TEXELS
  *(__global long*)sum += x;
#else
  add_shared(sum, x);
#endif
}

/* To the texels that a number is made of. number: where its texture is told; x: the adjoint of it in each channel, or
 * for each component of a direction */
INLINE void add_to_texels(const Launch* launch, int number, TexturePlace place, const long x[TEXEL_CHANNELS]) {
  const int texture = launch->number_textures[number];
  if (texture < 0 || launch->textures[texture].gradient < 0) return;
  __global const TextureRecord* t = launch->textures + texture;
  int which[4];
  float weight[4];
  const int shown = texture_texels(t, launch->texels, place, which, weight);
  UNROLL_FOR(int k = 0; k < 4; ++k) {
    if (k >= shown) continue;
    UNROLL_FOR(int c = 0; c < TEXEL_CHANNELS; ++c)
      add_to_texel(launch, t->gradient + which[k], c, convert_long_rte(weight[k] * (float)x[c]));
  }
}

/* As add_to_texels, of heights. x: the adjoints of their two slopes. Returns what was lost. */
INLINE uint add_to_heights(const Launch* launch, int number, TexturePlace place, const long x[TEXEL_CHANNELS]) {
  const int texture = launch->number_textures[number];
  uint lost = 0;
  if (texture < 0 || launch->textures[texture].gradient < 0) return lost;
  __global const TextureRecord* t = launch->textures + texture;
  int which[4];
  float along_u[4], along_v[4];
  const int shown = texture_slope_texels(t, place.u, place.v, which, along_u, along_v);
  UNROLL_FOR(int k = 0; k < 4; ++k) {
    if (k >= shown) continue;
    const float part = along_u[k] * (float)x[0] + along_v[k] * (float)x[1];
    const bool fits = fabs(part) < 4e18f;
    add_to_texel(launch, t->gradient + which[k], 0, convert_long_rte(fits ? part : 0.0f));
    lost += fits ? 0 : 1;
  }
  return lost;
}

/* Computes the adjoint of the number whose first slot is `texels`, by channel or by component. */
INLINE void adjoint_of_number(const AdjointSums* p, int model, int texels, LongLanes sum[TEXEL_CHANNELS]) {
  const int role = role_of(model, texels);
  const bool direction = role == ROLE_NORMAL || role == ROLE_BUMP;
  UNROLL_FOR(int c = 0; c < TEXEL_CHANNELS; ++c) sum[c].integer = (LONG)(0);
  UNROLL_FOR(int k = 0; k < SUMS; ++k)
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
      if (summed[k].texels == texels && is_summed(k, model, c))
        sum[direction ? summed[k].slot - texels : c].integer += p->sum[k * RADIANCE_CHANNELS + c];
}

/* As add_adjoint, whose sums these are, too. */
INLINE void add_adjoint_to_texels(const Launch* launch, uint bits, const AdjointSums* p, int model, INT first,
                                  const REAL uv[]) {
  const TexturePlaces places = texture_places(uv);
  Lanes instance;
  instance.integer = first;
  UNROLL_FOR(int k = 0; k < SUMS; ++k) {
    const int texels = summed[k].texels;
    const bool begins = k == 0 || summed[k - 1].model != model || summed[k - 1].texels != texels; /* a number */
    if (summed[k].model != model || texels < 0 || !begins) continue;
    LongLanes sum[TEXEL_CHANNELS];
    adjoint_of_number(p, model, texels, sum);
    uint lost = 0;
    FOR_EACH_LANE(l, bits) {
      long x[TEXEL_CHANNELS];
      UNROLL_FOR(int c = 0; c < TEXEL_CHANNELS; ++c) x[c] = sum[c].i[l];
      const TexturePlace place = texture_place_of(launch, &places, l);
      if (role_of(model, texels) == ROLE_BUMP)
        lost += add_to_heights(launch, instance.i[l] + texels, place, x);
      else
        add_to_texels(launch, instance.i[l] + texels, place, x);
    }
    if (lost) add_to_gradient(launch, SUMS_OF_A_SET - 1, lost);
  }
}
#endif

/* Adds the adjoints of the numbers of a model to the sums of each lane's instance, which begins at first. uv:
 * where its textures were looked up; null: it has none. */
INLINE void add_adjoint(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, MASK mask,
                        const AdjointSums* p, int model, INT first, const REAL uv[]) {
  Lanes at;
  at.integer = gradient_set(job, pool, slots) * SUMS_OF_A_SET + first * RADIANCE_CHANNELS;
  const uint bits = lane_bits(mask);
  UNROLL_FOR(int k = 0; k < SUMS; ++k)
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
      if (!is_summed(k, model, c)) continue;
      LongLanes sum;
      sum.integer = p->sum[k * RADIANCE_CHANNELS + c];
      FOR_EACH_LANE(l, bits) add_to_gradient(launch, at.i[l] + summed[k].at * RADIANCE_CHANNELS + c, sum.i[l]);
    }
#if TEXEL_SUMS
  if (uv && !job->contrast) add_adjoint_to_texels(launch, bits, p, model, first, uv);
#endif
  add_lost(launch, mask & p->beyond);
}

/* Adds the gradient by the light, whose derivative is a factor of what a path gathers beside it. change: of the
 * radiance by the logarithm of parameter p */
INLINE void add_light_adjoint(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                              MASK mask, int p, const REAL change[RADIANCE_CHANNELS]) {
  const INT first = gradient_set(job, pool, slots) * SUMS_OF_A_SET + FIRST_LIGHT_NUMBER + p * RADIANCE_CHANNELS;
  Lanes at;
  at.integer = first;
  const uint bits = lane_bits(mask);
  MASK beyond = (MASK)(0);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    LongLanes sum;
    sum.integer = rounded(LOAD(pool, PIXEL_ADJOINT + c, slots) * change[c], &beyond);
    FOR_EACH_LANE(l, bits) add_to_gradient(launch, at.i[l] + c, sum.i[l]);
  }
  add_lost(launch, mask & beyond);
}
#endif

#if VOXEL_SUMS
/* A path that may become a probe (scattering/probe.h): which of its flights will, each of its probes from a part of its own. sum: over all
 * of them */
INLINE void begin_probe(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, REAL sum) {
  const Random random = load_random(job, pool, slots);
  REAL u[4];
  draw(&random, STREAM_CHOICE, u);
  STORE(pool, PROBE_TARGET, slots, SELECT(sum > 0.0f, (u[0] + job->probe) * (sum / PROBES), INFINITY));
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c)
    STORE(pool, PROBE_WEIGHT + c, slots, LOAD(pool, PIXEL_ADJOINT + c, slots) * (sum / PROBES));
  STORE_INT(pool, PROBE_FIELD, slots, -1);
}
#endif

/* A path that is traced again learns what it gathers. */
INLINE void begin_replay(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid,
                         INT pixel, INT sample) {
#if ADJOINT
  if (!job->replay) return;
  const INT row = SELECT_INT(valid, (pixel - job->first_pixel) / job->pixel_step, 0);
  const INT output = SELECT_INT(valid, job->first_output + row * job->samples + sample - job->first_sample, 0);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    STORE(pool, TOTAL + c, slots, GATHER((launch->samples + c), output * SAMPLE_SIZE));
    STORE(pool, PIXEL_ADJOINT + c, slots,
          GATHER((launch->pixel_adjoints + c), (job->first_pixel_adjoint + row) * RADIANCE_CHANNELS));
  }
  UNROLL_FOR(int c = 0; c < BASELINE_TOTALS; ++c)
    STORE(pool, TOTAL_BASELINE + c, slots, GATHER((launch->samples + RADIANCE_CHANNELS + c), output * SAMPLE_SIZE));
#if VOXEL_SUMS
  begin_probe(launch, job, pool, slots, GATHER((launch->samples + SAMPLE_SIZE - 1), output * SAMPLE_SIZE));
#endif
#endif
}

#endif
