/* The BSDF where paths have arrived at a surface. */
#ifndef ITN_STAGE_REFLECTOR_H
#define ITN_STAGE_REFLECTOR_H
#include "path/event_random.h"
#include "scattering/bsdf.h"
#include "stage/surface.h"

/* The state of a stage's BSDF where the paths have arrived. */
typedef struct {
  REAL n[MOST_SLOTS];
  Frame frame; /* shading frame, on the side of arrival */
  REAL3 wi;
} Reflector;

INLINE Reflector load_reflector(const Launch* launch, int model, const Surface* s, MASK back) {
  Reflector r;
  load_numbers(launch, model, s->first_number, s->texture, r.n);
  const REAL3 normal = scale3(s->frame, SELECT(back, -1.0f, 1.0f));
  if (bsdf_traits(model) & BSDF_ANISOTROPIC)
    r.frame = make_frame_along(normal, surface_tangent(launch->primitives, s->primitive, s->position, s->normal));
  else
    r.frame = make_frame(normal);
  bsdf_bump(model, launch, s->primitive, s->position, s->normal, &r.frame, r.n);
  r.wi = scale3(frame_to_local(&r.frame, s->direction), -1.0f);
  return r;
}

/* Structures: a leaf for the sample, which may let the path pass straight on. Returns which lanes do. */
INLINE MASK pick_leaf(int model, const Random* random, Reflector* r) {
  if (!(bsdf_traits(model) & BSDF_STRUCTURE)) return (MASK)(0);
  REAL v[4];
  draw(random, 2, v);
  bsdf_pick(model, r->n, r->wi, v[0]);
  return bsdf_passes(model, r->n);
}

#endif
