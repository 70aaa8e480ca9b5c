/* Values of measured tables, which models cannot reach: looked up before their functions are called, to the numbers that
 * hold them (model/bsdf/merl.h). */
#ifndef ITN_MEASURED_H
#define ITN_MEASURED_H
#include "path/launch.h"
#include "model/bsdf/merl.h"

/* The bin whose centre is at or before `place`, among 0 .. last - 1, and how far it is to the next. */
INLINE INT measured_bin(REAL place, int last, REAL* beyond) {
  const REAL from_centre = MIN(MAX(place - 0.5f, (REAL)(0.0f)), (REAL)((float)last));
  const INT bin = CAST_INT(MIN(from_centre, (REAL)((float)(last - 1))));
  *beyond = from_centre - CAST_REAL(bin);
  return bin;
}

/* n: of the model `merl`. Tables lie one after the other, of each bin the channels beside each other. */
INLINE void merl_measure(const Launch* launch, REAL n[], REAL3 wi, REAL3 wo) {
  REAL place[3], beyond[3], sum[CHANNELS];
  merl_place(wi, wo, place);
  const INT half_bin = measured_bin(place[0], MERL_HALF_BINS - 1, beyond);
  const INT difference = measured_bin(place[1], MERL_DIFFERENCE_BINS - 1, beyond + 1);
  /* azimuths go round: the first bin is behind the last */
  const REAL turn = place[2] - 0.5f;
  const REAL azimuth = MIN(MAX(SELECT(turn < 0.0f, turn + (float)MERL_AZIMUTH_BINS, turn), (REAL)(0.0f)),
                           (REAL)(MERL_AZIMUTH_BINS - 0.001f));
  const INT first = CAST_INT(azimuth), second = SELECT_INT(first == MERL_AZIMUTH_BINS - 1, 0, first + 1);
  beyond[2] = azimuth - CAST_REAL(first);
  const INT table = CAST_INT(n[MERL_table]) * MERL_BINS;
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) sum[c] = (REAL)(0.0f);
  UNROLL_FOR(int corner = 0; corner < 8; ++corner) {
    const int a = corner & 1, b = corner >> 1 & 1, d = corner >> 2;
    const REAL weight =
        (a ? beyond[0] : 1.0f - beyond[0]) * (b ? beyond[1] : 1.0f - beyond[1]) * (d ? beyond[2] : 1.0f - beyond[2]);
    const INT row = (half_bin + a) * MERL_DIFFERENCE_BINS + difference + b;
    const INT at = 3 * (table + row * MERL_AZIMUTH_BINS + (d ? second : first));
    UNROLL_FOR(int c = 0; c < CHANNELS; ++c) sum[c] += weight * GATHER((launch->measured + c), at);
  }
  UNROLL_FOR(int c = 0; c < CHANNELS; ++c) n[MERL_measured + c] = sum[c];
}

#endif
