/* Stage rough dielectric: a microfacet boundary between two refractive indices. */
#ifndef ITN_STAGE_ROUGH_DIELECTRIC_H
#define ITN_STAGE_ROUGH_DIELECTRIC_H
#include "model/rough_dielectric.h"
#include "stage/boundary.h"

#if HAS_ROUGH_DIELECTRIC
inline void rough_dielectric_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots,
                                   MASK valid) {
  Surface s = load_surface(launch, job, pool, slots, valid);
  Random random = load_random(job, pool, slots);
  REAL u[4];
  draw(&random, 0, u);
  const REAL alpha = bsdf_real(launch, s.bsdf, FIELD_OF(BsdfRecord, alpha));
  const REAL eta_inside = bsdf_real(launch, s.bsdf, FIELD_OF(BsdfRecord, eta));
  const Frame frame = make_frame(s.frame);
  const REAL3 wi = scale3(frame_to_local(&frame, s.direction), -1.0f);
  const REAL eta = SELECT(wi.z > 0.0f, eta_inside, 1.0f / eta_inside); /* far side over near side */
  REAL3 wo;
  REAL weight, pdf;
  MASK reflects;
  rough_dielectric_sample(DISTRIBUTION, alpha, eta, wi, u[0], u[1], u[2], &wo, &weight, &pdf, &reflects);
  /* the factor 1 / eta^2 of radiance goes into REFRACTION_SCALE */
  weight *= SELECT(reflects, 1.0f, eta * eta);
  scatter_at_boundary(launch, job, pool, slots, valid, &s, &random, u[3], frame_to_world(&frame, wo), weight,
                      (REAL)(0.0f), reflects, 1.0f / eta);
}

#endif

#endif
