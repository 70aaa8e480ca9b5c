/* Gradients by voxels (derivative/voxel_gradient.h): below which values of a field the places where paths scatter, or go on
 * from, tell less of its voxels than probes do. */
#ifndef ITN_KNEE_H
#define ITN_KNEE_H

#define EXTINCTION_KNEE 0.25f /* of the field's mean value */
#define KNEE_DEPTH 4.0f       /* or so much optical depth over the longest side of its box, if that is more */
#define ALBEDO_KNEE 0.1f

#endif
