/* Stage diffuse: a Lambertian surface, one- or two-sided; light is sampled, the path goes on cosine-distributed. */
#ifndef ITN_STAGE_DIFFUSE_H
#define ITN_STAGE_DIFFUSE_H
#include "lib/light_sampling.h"
#include "lib/optical_depth.h"
#include "lib/texture.h"
#include "model/diffuse.h"
#include "stage/surface.h"

#if HAS_DIFFUSE
inline void diffuse_stage(const Launch* launch, __global const JobRecord* job, Pool* pool, INT slots, MASK valid) {
  Surface s = load_surface(launch, job, pool, slots, valid);
  Random random = load_random(job, pool, slots);
  REAL u[4];
  draw(&random, 0, u);

  Lanes bsdf, red, green, blue, tu, tv, both_sides;
  bsdf.integer = s.bsdf;
  tu.real = s.texture[0];
  tv.real = s.texture[1];
  UNROLL for (int l = 0; l < WIDTH; ++l) {
    __global const BsdfRecord* b = launch->bsdfs + bsdf.i[l];
    float rgb[3] = {b->reflectance[0], b->reflectance[1], b->reflectance[2]};
#if HAS_TEXTURE
    if (b->texture >= 0) texture_value(launch->textures + b->texture, launch->texels, tu.f[l], tv.f[l], rgb);
#endif
    red.f[l] = rgb[0];
    green.f[l] = rgb[1];
    blue.f[l] = rgb[2];
    both_sides.i[l] = b->twosided ? -1 : 0;
  }
  REAL reflectance[3] = {red.real, green.real, blue.real};

  /* shading frame on the side of arrival */
  REAL cos_i = -dot3(s.direction, s.frame);
  MASK reflects = valid & ((cos_i > 0.0f) | ((cos_i < 0.0f) & (both_sides.integer != 0)));
  REAL side = SELECT(cos_i < 0.0f, -1.0f, 1.0f);
  Frame frame = make_frame(scale3(s.frame, side));

  REAL throughput[THROUGHPUT_CHANNELS];
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) throughput[c] = LOAD(pool, THROUGHPUT + c, slots) * reflectance[c];
  REAL weight[3];
  channel_weights(pool, slots, (REAL)(1.0f), weight);
  INT depth = LOAD_INT(pool, DEPTH, slots) + 1;
  const REAL largest = brightest(throughput, weight);

  /* roulette first: paths that end here need no light */
  MASK dies = roulette(job, plain_depth(depth), u[2], reflects, largest, throughput);
  MASK goes_on = reflects & !dies;
  const REAL3 in_frame = diffuse_sample(u[0], u[1]);
  const REAL3 direction = frame_to_world(&frame, in_frame);
  UNROLL for (int c = 0; c < THROUGHPUT_CHANNELS; ++c) STORE(pool, THROUGHPUT + c, slots, throughput[c]);
  STORE_INT(pool, EVENT, slots, random.event + 1);
  STORE_INT(pool, DEPTH, slots, depth);
  finish(launch, job, pool, slots, valid & !goes_on);
#if LIGHT_SAMPLING
  const Scores scores = load_scores(job, pool, slots);
  const MASK everywhere = valid | !valid;
  __global const EmitterRecord* emitter = launch->emitters + job->emitter;
  REAL v[4];
  draw(&random, 1, v);
  REAL3 to_light;
  REAL pdf, light[3];
  const MASK sampled = sample_light(launch, emitter, everywhere, v, &to_light, &pdf, light);
  const REAL bsdf_pdf = diffuse_pdf(frame_to_local(&frame, to_light));
  REAL value = bsdf_pdf / (pdf + bsdf_pdf) * LOAD(pool, REFRACTION_SCALE, slots);
#if OPERATOR_SINGLE
  value = SELECT(depth >= SCATTERED_ONCE, value, 0.0f);
#endif
  REAL connection_weight[RADIANCE_CHANNELS];
  UNROLL for (int c = 0; c < RADIANCE_CHANNELS; ++c)
    connection_weight[c] = throughput[THROUGHPUT_CHANNELS == 1 ? 0 : c] * weight[c] * value;
  const MediumStep in_vacuum = no_medium_step((INT)(0));
  SurfaceStep connection_step = no_surface_step();
  step_reflection(&connection_step, s.bsdf, reflectance, frame_to_local(&frame, to_light), goes_on);
  add_connection(launch, job, pool, slots, goes_on & sampled & (value > 0.0f),
                 beside_surface(launch->primitives, s.primitive, s.position, s.normal, to_light), to_light, s.primitive,
                 LOAD_INT(pool, MEDIUM, slots), connection_weight, light, &scores, &in_vacuum, &connection_step);
  STORE(pool, LAST_PDF, slots, -diffuse_pdf(in_frame));
#else
  STORE(pool, LAST_PDF, slots, 0.0f);
#endif
  Scores onward = load_scores(job, pool, slots);
  SurfaceStep step = no_surface_step();
  step_reflection(&step, s.bsdf, reflectance, in_frame, goes_on);
  add_surface_step(job, &onward, &step);
  store_scores(launch, job, pool, slots, &onward, goes_on);
  leave_surface(launch, pool, slots, goes_on, &s, direction);
}

#endif

#endif
