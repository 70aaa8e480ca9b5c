/* What smooth and rough dielectric boundaries share after a direction has been drawn. */
#ifndef ITN_STAGE_BOUNDARY_H
#define ITN_STAGE_BOUNDARY_H
#include "stage/surface.h"

/* A member of each lane's BSDF. */
inline REAL bsdf_real(const Launch* launch, INT bsdf, int member) {
  return GATHER(((__global const float*)launch->bsdfs + member), bsdf * (int)(sizeof(BsdfRecord) / sizeof(float)));
}

inline REAL boundary_tint(const Launch* launch, INT bsdf, MASK reflects, int channel) {
  return SELECT(reflects, bsdf_real(launch, bsdf, FIELD_OF(BsdfRecord, specular_reflectance) + channel),
                bsdf_real(launch, bsdf, FIELD_OF(BsdfRecord, specular_transmittance) + channel));
}

/* weight: f cos / p without the specular tints; pdf: LAST_PDF of d; inverse_eta: near over far index where the path is
 * refracted. Radiance scales by inverse_eta^2 on the way (basic radiance is conserved); roulette does not see this
 * factor, as in Mitsuba. */
inline void scatter_at_boundary(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid,
                                const Surface* s, const Random* random, REAL u, REAL3 d, REAL weight, REAL pdf,
                                MASK reflects, REAL inverse_eta) {
  REAL throughput[THROUGHPUT_CHANNELS];
  MASK real = valid & !s->misplaced;
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) {
    REAL tint = boundary_tint(launch, s->bsdf, reflects, c);
    throughput[c] = LOAD(pool, THROUGHPUT + c, slots) * SELECT(real, weight * tint, 1.0f);
  }
  INT depth = LOAD_INT(pool, DEPTH, slots) + SELECT_INT(real, 1, 0);
  REAL weights[3];
  channel_weights(pool, slots, (REAL)(1.0f), weights);
  const REAL largest = brightest(throughput, weights);
  MASK dies = roulette(job, plain_depth(depth), u, real, largest, throughput);
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) STORE(pool, THROUGHPUT + c, slots, throughput[c]);
  STORE_INT(pool, DEPTH, slots, depth);
  STORE_INT(pool, EVENT, slots, random->event + 1);
  REAL scale = SELECT(real & !reflects, inverse_eta * inverse_eta, 1.0f);
  STORE(pool, REFRACTION_SCALE, slots, LOAD(pool, REFRACTION_SCALE, slots) * scale);
  STORE(pool, LAST_PDF, slots, SELECT(real, pdf, LOAD(pool, LAST_PDF, slots)));
  leave_surface(launch, pool, slots, valid & !dies, s, select3(s->misplaced, s->direction, d));
  finish(launch, job, pool, slots, dies);
}

#endif
