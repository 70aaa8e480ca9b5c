/* Gradients by the voxels of the fields that media's sigma_t and albedo are times (texture/field.h): what derivative/adjoint.h sums
 * for a number, shared out among the voxels that the field was interpolated from. A voxel of sigma_t moves
 *   the extinction on all ways: what comes over them, less, estimated at one place of each coarse cell
 *   (field_column_density)
 *   the light that ways scatter, in two parts:
 *     at scatterings that paths have: their score is 1 / value, but no more than 1 / knee
 *     where the field is below the knee, and 0: what the former lacks, 1 - value / knee of a scattering, at places where
 *     no path needs to scatter: a probe (scattering/probe.h)
 * One of the albedo moves what goes on from a scattering: again with a score of at most 1 / knee, and a probe for what
 * that lacks, since paths end where the albedo is 0.
 *
 * Voxels that stand for numbers of phase functions are in scattering/phase_score.h.
 *
 * So no voxel is left out, and no score grows without bound where values come near 0. Values at the greatest of their
 * cell are nothing special: null collisions have no scores. Sums are as those by texels. */
#ifndef ITN_VOXEL_GRADIENT_H
#define ITN_VOXEL_GRADIENT_H
#include "derivative/adjoint.h"
#include "texture/field.h"
#include "shared/knee.h"

#if VOXEL_SUMS
/* The extinction of a field below which probes take part. sigma_t: a factor of the field; any is right. Measured:
 * tools/lab/voxel_estimators.cpp */
INLINE REAL knee_of(__global const FieldRecord* field, REAL sigma_t) {
  const float size =
      fmax(field->high[0] - field->low[0], fmax(field->high[1] - field->low[1], field->high[2] - field->low[2]));
  return MAX((REAL)(EXTINCTION_KNEE * field->mean), KNEE_DEPTH / (MAX(sigma_t, (REAL)(1e-20f)) * size));
}

/* The voxels that the field is interpolated from at a place. */
typedef struct {
  Lanes at[8];
  REAL share[8];
} Voxels;

INLINE Voxels voxels_at(__global const FieldRecord* field, REAL3 p) {
  INT x[2], y[2], z[2];
  REAL right, up, deep;
  neighbours(field, 0, p, &x[0], &x[1], &right);
  neighbours(field, 1, p, &y[0], &y[1], &up);
  neighbours(field, 2, p, &z[0], &z[1], &deep);
  Voxels v;
  UNROLL_FOR(int k = 0; k < 8; ++k) {
    const int i = k & 1, j = (k >> 1) & 1, l = k >> 2;
    v.at[k].integer = (z[l] * field->size[1] + y[j]) * field->size[0] + x[i];
    v.share[k] = (i ? right : 1.0f - right) * (j ? up : 1.0f - up) * (l ? deep : 1.0f - deep);
  }
  return v;
}

/* Adds the adjoint of the field's value at a place, in each channel of the radiance, to the sums of its voxels
 * and to that of them all, in the set of each path's pixel. */
INLINE void add_to_voxels(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots, MASK mask,
                          __global const FieldRecord* field, REAL3 place, const REAL x[RADIANCE_CHANNELS]) {
  const Voxels v = voxels_at(field, place);
  Lanes set;
  set.integer = gradient_set(job, pool, slots) * SUMS_OF_A_SET + FIRST_VOXEL_NUMBER + field->sum * RADIANCE_CHANNELS;
  const uint bits = lane_bits(mask);
  __global uint* const sums = launch->texel_gradient + (size_t)field->gradient * (2 * TEXEL_CHANNELS);
  MASK beyond = (MASK)(0);
  UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) {
    LongLanes all;
    all.integer = (LONG)(0);
    UNROLL_FOR(int k = 0; k < 8; ++k) {
      LongLanes part;
      part.integer = rounded(v.share[k] * x[c], &beyond);
      all.integer += part.integer;
      if (job->contrast) continue;
      FOR_EACH_LANE(l, bits) {
        if (part.i[l] == 0) continue;
        __global uint* sum = sums + (size_t)v.at[k].i[l] * (2 * TEXEL_CHANNELS) + 2 * c;
#if OWN_TEXELS
        *(__global long*)sum += part.i[l];
#else
        add_shared(sum, part.i[l]);
#endif
      }
    }
    FOR_EACH_LANE(l, bits) add_to_gradient(launch, set.i[l] + c, all.i[l]);
  }
  add_lost(launch, mask & beyond);
}

/* The extinction on a way. u: as of field_column_density; x: as of add_to_voxels, of a unit of length */
INLINE void add_way_to_voxels(const Launch* launch, __global const JobRecord* job, const Pool* pool, INT slots,
                              MASK mask, __global const FieldRecord* field, REAL3 from, REAL3 direction, REAL distance,
                              REAL u, const REAL x[RADIANCE_CHANNELS]) {
  Way w = enter_field(launch, field, from, direction, distance, mask);
  while (ANY(w.inside)) {
    const REAL end = end_of_cell(&w);
    REAL of_cell[RADIANCE_CHANNELS];
    UNROLL_FOR(int c = 0; c < RADIANCE_CHANNELS; ++c) of_cell[c] = x[c] * (end - w.at);
    add_to_voxels(launch, job, pool, slots, w.inside, field, add3(from, scale3(direction, mixed(w.at, end, u))),
                  of_cell);
    next_cell(launch, field, direction, w.inside, &w);
  }
}
#endif

#endif
