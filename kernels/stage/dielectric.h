/* Stage dielectric: a smooth boundary between two refractive indices; reflects or refracts by chance (Fresnel). */
#ifndef ITN_STAGE_DIELECTRIC_H
#define ITN_STAGE_DIELECTRIC_H
#include "model/fresnel_dielectric.h"
#include "stage/boundary.h"

inline void dielectric_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  Surface s = load_surface(launch, job, pool, slots, valid);
  Random random = load_random(job, pool, slots);
  REAL u[4];
  draw(&random, 0, u);
  REAL eta_inside = bsdf_real(launch, s.bsdf, FIELD_OF(BsdfRecord, eta));
  REAL cosine = -dot3(s.direction, s.frame);
  MASK outside = cosine > 0.0f;
  REAL eta = SELECT(outside, eta_inside, 1.0f / eta_inside); /* far side over near side */
  REAL cos_i = MIN(ABS(cosine), (REAL)(1.0f));
  REAL fresnel = fresnel_dielectric(cos_i, eta), cos_t = fresnel_cos_t(cos_i, eta);
  MASK reflects = u[0] < fresnel;
  REAL inverse = SELECT(reflects, 1.0f, 1.0f / eta);
  REAL along = SELECT(reflects, 2.0f * cos_i, cos_i * inverse - cos_t);
  REAL3 d = add3(scale3(s.direction, inverse), scale3(s.frame, SELECT(outside, along, -along)));
  d = scale3(d, 1.0f / SQRT(dot3(d, d)));
  scatter_at_boundary(launch, job, pool, slots, valid, &s, &random, u[3], d, (REAL)(1.0f), (REAL)(0.0f),
                      reflects, inverse);
}

#endif
