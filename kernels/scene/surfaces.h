/* Which models the scene at hand has: of one without surfaces and media. Programs get their own in the place of this
 * file (runtime/compile/surfaces.h). */
#ifndef ITN_SURFACES_H
#define ITN_SURFACES_H

#define SURFACES 0            /* beside null */
#define SURFACE_LIST(SURFACE) /* SURFACE(its number, from 1 on; name; variant) */
#define STRUCTURE_LIST(BSDF)      /* BSDF(name, PREFIX, type, variants), as in model/bsdf/list.h */
#define PASSED_SURFACES(SURFACE)  /* of SURFACE_LIST: structures with BSDF_PASSES */
#define ORIGIN_WORDS 1            /* lib/numbers.h */
#define PHASE_COUNT 0
#define PHASES_OF_SCENE(PHASE)  /* PHASE(name, PREFIX) */
#define LIGHTS_OF_SCENE(LIGHT)  /* LIGHT(name, PREFIX) */
#define TEXTURED(model, slot) 0 /* does some instance have a texture in place of the number? */

#endif
