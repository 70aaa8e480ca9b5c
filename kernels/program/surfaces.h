/* The models that the scene at hand has; this file is of a scene without surfaces and media. Programs get their own
 * in the place of this file (runtime/render/compile/surfaces.h). Lines of the families' lists: MODEL(name, PREFIX). */
#ifndef ITN_SURFACES_H
#define ITN_SURFACES_H

#define SURFACES 0            /* beside null */
#define SURFACE_LIST(SURFACE) /* SURFACE(its number, from 1 on; name; variant) */
#define BSDFS_OF_SCENE(MODEL)
#define MEDIUM_COUNT 0
#define MEDIA_OF_SCENE(MODEL)
#define STRUCTURES_OF_SCENE(MODEL)
#define PASSED_SURFACES(SURFACE) /* of SURFACE_LIST: structures with BSDF_PASSES */
#define ORIGIN_WORDS 1           /* texture/numbers.h */
#define PHASE_COUNT 0
#define PHASES_OF_SCENE(MODEL)
#define TABLES_OF_SCENE(MODEL)   /* scattering/mixture.h; of mixtures, too */
#define MIXTURES_OF_SCENE(MODEL) /* of PHASES_OF_SCENE */
#define LIGHTS_OF_SCENE(MODEL)
#define ENVIRONMENTS_OF_SCENE(MODEL)
#define TEXTURED(model, slot) 0 /* does some instance have a texture in place of the number? */

#endif
