/* What XML nests in the scene at hand, as BSDFs (lib/structure.h) and as phase functions (lib/mixture.h): of one that nests
 * nothing. Programs get their own in the place of this file (runtime/compile/surfaces.h). */
#ifndef ITN_STRUCTURES_H
#define ITN_STRUCTURES_H
#endif
