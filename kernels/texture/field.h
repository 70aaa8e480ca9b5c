/* Values that differ from place to place: a grid of voxels in a box, and over the same box a coarse grid of the greatest
 * and least values of its cells, through which rays step (shared/scene_layout.h, FieldRecord).
 *
 *   field_value           at a place
 *   field_flight          distance to the next scattering: null collisions against the greatest values (delta tracking)
 *   field_transmittance   the least values are exact, the rest is ratio tracking (residual ratio tracking)
 *   field_column_density  the integral of the field along a way, without bias: one place of each cell on it
 *
 * Where the field is the same everywhere the latter three are exact. All are of one field, for the lanes in `mask`;
 * next_field takes lanes apart. Random numbers are streams of their own of the event that asks.
 *
 *   Woodcock et al. 1965; Novak et al. 2014, doi:10.1145/2661229.2661292 (residual ratio tracking); Miller, Georgiev,
 *   Jarosz 2019, doi:10.1145/3306346.3323025 (spectral weights of null collisions) */
#ifndef ITN_FIELD_H
#define ITN_FIELD_H
#include "path/event_random.h"
#include "path/spectral.h"
#include "path/launch.h"

#if HAS_FIELDS
#define ENDLESS 2e30f /* distance of a flight that scatters nowhere */

/* Streams of random numbers (path/random.h) beside those of stages. */
enum { STREAM_COLUMN_DENSITY = 2, STREAM_FLIGHT = 0x100, STREAM_TRANSMITTANCE = 0x1000000 };

/* Takes the lanes of one field out of `left`; index: of each lane. */
INLINE MASK next_field(const Launch* launch, INT index, uint* left, __global const FieldRecord** field) {
  Lanes of;
  of.integer = index;
  const int number = of.i[LOWEST_BIT(*left)];
  const MASK here = lane_mask(*left) & (index == number);
  *left &= ~lane_bits(here);
  *field = launch->fields + number;
  return here;
}

/* Wraps the index of a voxel along an axis of n voxels. Finite for any i. */
INLINE INT wrapped(int wrap, INT i, int n) {
  if (wrap == TEXTURE_CLAMP) return clamp(i, (INT)(0), (INT)(n - 1));
  const int period = wrap == TEXTURE_MIRROR ? 2 * n : n;
  INT m = i % period;
  m += SELECT_INT(m < 0, period, 0);
  return SELECT_INT(m < n, m, period - 1 - m);
}

/* Voxels on both sides of a place, and the share of the second. */
INLINE void neighbours(__global const FieldRecord* field, int axis, REAL3 p, INT* first, INT* second, REAL* share) {
  __global const float* row = field->to_voxels + 4 * axis;
  const REAL v = MAX(MIN(row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3], (REAL)(1e8f)), (REAL)(-1e8f));
  const REAL below = floor(field->nearest ? v : v - 0.5f);
  *share = field->nearest ? (REAL)(0.0f) : v - 0.5f - below;
  *first = wrapped(field->wrap, CAST_INT(below), field->size[axis]);
  *second = field->nearest ? *first : wrapped(field->wrap, CAST_INT(below) + 1, field->size[axis]);
}

INLINE REAL mixed(REAL a, REAL b, REAL share) { return a + share * (b - a); }

/* The place where the voxel at x, y, z is stored, in voxels. */
INLINE INT voxel_index(const Launch* launch, __global const FieldRecord* field, INT x, INT y, INT z) {
#if PACKED_FIELDS
  if (field->first_brick >= 0) {
    __global const int* bricks = (__global const int*)launch->voxels + field->first_brick;
    const INT brick = GATHER_INT(
        bricks, ((z >> BRICK_BITS) * field->bricks[1] + (y >> BRICK_BITS)) * field->bricks[0] + (x >> BRICK_BITS));
    const INT row = (((brick << BRICK_BITS) + (z & (BRICK - 1))) << BRICK_BITS) + (y & (BRICK - 1));
    return (row << BRICK_BITS) + (x & (BRICK - 1));
  }
#endif
  return (z * field->size[1] + y) * field->size[0] + x;
}

/* index: voxel_index times the stored channels, and the channel */
INLINE REAL voxel_value(const Launch* launch, __global const FieldRecord* field, INT index) {
  __global const float* voxels = launch->voxels + field->first_voxel;
#if PACKED_FIELDS
  if (field->bits < 32) {
    const int shift = field->bits == 8 ? 2 : 1; /* 4 or 2 numbers a word */
    const UINT word = AS_UINT(GATHER_INT(((__global const int*)voxels), index >> shift));
    const UINT number = (word >> AS_UINT((index & ((1 << shift) - 1)) * field->bits)) & ((1u << field->bits) - 1u);
    return field->lowest + field->step * CAST_REAL(AS_INT(number));
  }
#endif
  return GATHER(voxels, index);
}

/* value: a channel each; a grey field has the first alone where channels is 1 */
INLINE void field_value(const Launch* launch, __global const FieldRecord* field, REAL3 p, int channels, REAL value[]) {
  INT x[2], y[2], z[2], at[8];
  REAL right, up, deep, v[8];
  neighbours(field, 0, p, &x[0], &x[1], &right);
  neighbours(field, 1, p, &y[0], &y[1], &up);
  neighbours(field, 2, p, &z[0], &z[1], &deep);
  const int stored = field->channels;
  if (field->nearest) {
    at[0] = voxel_index(launch, field, x[0], y[0], z[0]) * stored;
    for (int c = 0; c < channels; ++c) value[c] = c < stored ? voxel_value(launch, field, at[0] + c) : value[0];
    return;
  }
  UNROLL_FOR(int k = 0; k < 8; ++k) at[k] = voxel_index(launch, field, x[k & 1], y[(k >> 1) & 1], z[k >> 2]) * stored;
  for (int c = 0; c < channels; ++c) {
    if (c >= stored) {
      value[c] = value[0];
      continue;
    }
    UNROLL_FOR(int k = 0; k < 8; ++k) v[k] = voxel_value(launch, field, at[k] + c);
    value[c] = mixed(mixed(mixed(v[0], v[1], right), mixed(v[2], v[3], right), up),
                     mixed(mixed(v[4], v[5], right), mixed(v[6], v[7], right), up), deep);
  }
}

/* A way through the coarse cells of a field's box. */
typedef struct {
  REAL at, end; /* distances: where it is, and where it leaves the box or ends */
  REAL next[3]; /* distances to the next wall of the cell */
  INT cell[3];
  REAL greatest, least; /* values in the cell */
  MASK inside;          /* lanes on their way */
} Way;

INLINE void load_cell(const Launch* launch, __global const FieldRecord* field, Way* w) {
  const INT cell = (w->cell[2] * field->cells[1] + w->cell[1]) * field->cells[0] + w->cell[0];
  __global const float* cells = launch->voxels + field->first_cell;
  w->greatest = GATHER(cells, 2 * cell);
  w->least = GATHER((cells + 1), 2 * cell);
}

/* The components of a direction; none is 0, so that distances to walls are finite. */
INLINE void components(REAL3 d, REAL of[3]) {
  of[0] = d.x;
  of[1] = d.y;
  of[2] = d.z;
  UNROLL_FOR(int a = 0; a < 3; ++a) of[a] = SELECT(ABS(of[a]) < 1e-12f, 1e-12f, of[a]);
}

INLINE Way enter_field(const Launch* launch, __global const FieldRecord* field, REAL3 from, REAL3 direction,
                       REAL distance, MASK mask) {
  Way w;
  REAL o[3], d[3];
  components(direction, d);
  o[0] = from.x;
  o[1] = from.y;
  o[2] = from.z;
  w.at = (REAL)(0.0f);
  w.end = distance;
  UNROLL_FOR(int a = 0; a < 3; ++a) {
    const REAL low = (field->low[a] - o[a]) / d[a], high = (field->high[a] - o[a]) / d[a];
    w.at = MAX(w.at, MIN(low, high));
    w.end = MIN(w.end, MAX(low, high));
  }
  w.inside = mask & (w.at < w.end);
  UNROLL_FOR(int a = 0; a < 3; ++a) {
    const REAL place = MIN((o[a] + d[a] * w.at - field->low[a]) / field->cell_size[a], (REAL)(field->cells[a] - 1));
    const INT cell = CAST_INT(SELECT(w.inside, MAX(place, (REAL)(0.0f)), 0.0f));
    w.cell[a] = cell;
    const REAL wall = field->low[a] + field->cell_size[a] * CAST_REAL(cell + SELECT_INT(d[a] > 0.0f, 1, 0));
    w.next[a] = (wall - o[a]) / d[a];
  }
  load_cell(launch, field, &w);
  return w;
}

/* The distance at which the way leaves its cell. */
INLINE REAL end_of_cell(const Way* w) { return MAX(w->at, MIN(w->end, MIN(w->next[0], MIN(w->next[1], w->next[2])))); }

/* The lanes in `moves` step to the next cell, or end their way. */
INLINE void next_cell(const Launch* launch, __global const FieldRecord* field, REAL3 direction, MASK moves, Way* w) {
  const REAL end = end_of_cell(w), least = MIN(w->next[0], MIN(w->next[1], w->next[2]));
  REAL d[3];
  components(direction, d);
  MASK gone = end >= w->end, stepped = (MASK)(0);
  UNROLL_FOR(int a = 0; a < 3; ++a) {
    const MASK along = moves & !stepped & (w->next[a] == least);
    stepped = stepped | along;
    const INT cell = w->cell[a] + SELECT_INT(d[a] > 0.0f, 1, -1);
    const MASK out = along & ((cell < 0) | (cell >= field->cells[a]));
    gone = gone | out;
    w->cell[a] = SELECT_INT(along & !out, cell, w->cell[a]);
    w->next[a] += SELECT(along, field->cell_size[a] / ABS(d[a]), 0.0f);
  }
  w->at = SELECT(moves, end, w->at);
  w->inside = w->inside & !(moves & gone);
  if (ANY(w->inside & moves)) load_cell(launch, field, w);
}

/* On to the next collision at `rate` times the greatest value a unit of length. Lanes that meet none end their way. */
INLINE void next_collision(const Launch* launch, __global const FieldRecord* field, REAL3 direction, REAL rate, REAL u,
                           bool above_least, Way* w, REAL* passed_least) {
  REAL left = -LOG(u);
  MASK goes = w->inside;
  while (ANY(goes)) {
    const REAL end = end_of_cell(w), most = rate * (above_least ? w->greatest - w->least : w->greatest);
    const REAL room = most * (end - w->at);
    const MASK stays = goes & (left < room);
    const REAL to = SELECT(stays, MIN(w->at + left / most, end), end);
    if (above_least) *passed_least += SELECT(goes, w->least * (to - w->at), 0.0f);
    w->at = SELECT(stays, to, w->at);
    goes = goes & !stays;
    left = SELECT(goes, left - room, left);
    if (!ANY(goes)) break;
    next_cell(launch, field, direction, goes, w);
    goes = goes & w->inside;
  }
}

INLINE REAL of_hero_field(const REAL value[FIELD_CHANNELS], INT hero) {
  return FIELD_CHANNELS == 3 ? of_hero(value, hero) : value[0];
}

INLINE REAL largest_of(const REAL sigma_t[]) {
#if SPECTRAL
  return MAX(sigma_t[0], MAX(sigma_t[1], sigma_t[2]));
#else
  return sigma_t[0];
#endif
}

/* Distance to the next scattering before `distance`, else ENDLESS. sigma_t: what the field is times.
 * weight: spectral weights, which null collisions on the way change; there: the field where it scatters. */
INLINE REAL field_flight(const Launch* launch, __global const FieldRecord* field, const Random* random, REAL3 from,
                         REAL3 direction, REAL distance, const REAL sigma_t[], INT hero, MASK mask, REAL weight[3],
                         REAL there[FIELD_CHANNELS]) {
  Way w = enter_field(launch, field, from, direction, distance, mask);
  const REAL rate = largest_of(sigma_t);
  REAL result = (REAL)(ENDLESS), u[4], none;
  UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c) there[c] = (REAL)(1.0f);
  for (uint k = 0; ANY(w.inside); ++k) {
    if (k % 2 == 0) draw(random, STREAM_FLIGHT + k / 2, u);
    next_collision(launch, field, direction, rate, k % 2 ? u[2] : u[0], false, &w, &none);
    if (!ANY(w.inside)) break;
    REAL value[FIELD_CHANNELS];
    field_value(launch, field, add3(from, scale3(direction, w.at)), FIELD_CHANNELS, value);
    const REAL most = rate * w.greatest;
    const REAL own = of_hero(sigma_t, hero) * of_hero_field(value, hero);
    const MASK scatters = w.inside & ((k % 2 ? u[3] : u[1]) * most < own), null = w.inside & !scatters;
#if SPECTRAL
    REAL factor[3];
    UNROLL_FOR(int c = 0; c < 3; ++c)
      factor[c] = MAX(1.0f - sigma_t[c] * value[FIELD_CHANNELS == 3 ? c : 0] / most, (REAL)(0.0f));
    spectral_event(null, factor, weight);
#endif
    result = SELECT(scatters, w.at, result);
    UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c) there[c] = SELECT(scatters, value[c], there[c]);
    w.inside = null;
  }
  return result;
}

/* The integral of the field along a way, an estimate. u: uniform, which place of each cell stands for its part. */
INLINE void field_column_density(const Launch* launch, __global const FieldRecord* field, REAL3 from, REAL3 direction,
                                 REAL distance, REAL u, MASK mask, REAL column_density[FIELD_CHANNELS]) {
  Way w = enter_field(launch, field, from, direction, distance, mask);
  while (ANY(w.inside)) {
    const REAL end = end_of_cell(&w);
    REAL value[FIELD_CHANNELS];
    UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c) value[c] = w.greatest;
    if (ANY(w.inside & (w.least < w.greatest)))
      field_value(launch, field, add3(from, scale3(direction, mixed(w.at, end, u))), FIELD_CHANNELS, value);
    UNROLL_FOR(int c = 0; c < FIELD_CHANNELS; ++c) column_density[c] += SELECT(w.inside, value[c] * (end - w.at), 0.0f);
    next_cell(launch, field, direction, w.inside, &w);
  }
}

#define DIMMED 0.1f /* below, roulette decides whether a way is followed further */

/* Multiplies `through`, a throughput channel each, by an estimate of the transmittance of a way. segment: which way of a
 * connection this is; its random numbers are its own. */
INLINE void field_transmittance(const Launch* launch, __global const FieldRecord* field, const Random* random,
                                int segment, REAL3 from, REAL3 direction, REAL distance, const REAL sigma_t[],
                                MASK mask, REAL through[THROUGHPUT_CHANNELS]) {
  Way w = enter_field(launch, field, from, direction, distance, mask);
  const REAL rate = largest_of(sigma_t);
  REAL u[4], least = (REAL)(0.0f), chance = (REAL)(1.0f), ratio[THROUGHPUT_CHANNELS];
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) ratio[c] = (REAL)(1.0f);
  for (uint k = 0; ANY(w.inside); ++k) {
    if (k % 2 == 0) draw(random, (uint)(STREAM_TRANSMITTANCE * (segment + 1)) + k / 2, u);
    next_collision(launch, field, direction, rate, k % 2 ? u[2] : u[0], true, &w, &least);
    if (!ANY(w.inside)) break;
    REAL value[FIELD_CHANNELS], most = (REAL)(0.0f);
    field_value(launch, field, add3(from, scale3(direction, w.at)), FIELD_CHANNELS, value);
    const REAL above = rate * (w.greatest - w.least);
    UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) {
      const REAL sigma = sigma_t[SPECTRAL ? c : 0];
      const REAL left = 1.0f - sigma * (value[FIELD_CHANNELS == 3 ? c : 0] - w.least) / above;
      /* beside a cell of a dense field, by a rounding of the place, it may be much denser */
      ratio[c] = SELECT(w.inside, ratio[c] * MIN(MAX(left, (REAL)(-0.01f)), (REAL)(1.01f)), ratio[c]);
      most = MAX(most, ratio[c] * EXP(-(sigma * least)));
    }
    const MASK plays = w.inside & (most < DIMMED * chance);
    const REAL survival = MAX(most / (DIMMED * chance), (REAL)(0.05f));
    const MASK ends = plays & ((k % 2 ? u[3] : u[1]) >= survival);
    chance = SELECT(plays, chance * survival, chance);
    UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c) ratio[c] = SELECT(ends, 0.0f, ratio[c]);
    w.inside = w.inside & !ends;
  }
  UNROLL_FOR(int c = 0; c < THROUGHPUT_CHANNELS; ++c)
    through[c] *= SELECT(mask, ratio[c] * EXP(-(sigma_t[SPECTRAL ? c : 0] * least)) / chance, 1.0f);
}
#endif

#endif
