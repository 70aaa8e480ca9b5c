/* The structures that XML nests in the scene at hand, as BSDFs (scattering/structure.h) and as phase functions
 * (scattering/mixture.h); this file is of a scene that nests nothing. Programs get their own in the place of this file
 * (runtime/render/compile/surfaces.h). */
#ifndef ITN_STRUCTURES_H
#define ITN_STRUCTURES_H
#endif
