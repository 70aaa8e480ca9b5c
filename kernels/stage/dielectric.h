/* Stage dielectric: a smooth boundary between two refractive indices; reflects or refracts by chance (Fresnel). */
#ifndef ITN_STAGE_DIELECTRIC_H
#define ITN_STAGE_DIELECTRIC_H
#include "model/dielectric.h"
#include "stage/boundary.h"

#if HAS_DIELECTRIC
inline void dielectric_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  Surface s = load_surface(launch, job, pool, slots, valid);
  Random random = load_random(job, pool, slots);
  REAL u[4];
  draw(&random, 0, u);
  REAL eta_inside = bsdf_real(launch, s.bsdf, FIELD_OF(BsdfRecord, eta));
  const Frame frame = make_frame(s.frame);
  const REAL3 wi = scale3(frame_to_local(&frame, s.direction), -1.0f);
  const REAL eta = SELECT(wi.z > 0.0f, eta_inside, 1.0f / eta_inside); /* far side over near side */
  REAL3 wo;
  REAL weight;
  MASK reflects;
  dielectric_sample(eta, wi, u[0], &wo, &weight, &reflects);
  /* the weight is the factor 1 / eta^2 of radiance: it goes into REFRACTION_SCALE */
  scatter_at_boundary(launch, job, pool, slots, valid, &s, &random, u[3], frame_to_world(&frame, wo), (REAL)(1.0f),
                      (REAL)(0.0f), reflects, 1.0f / eta);
}

#endif

#endif
