/* The arguments by which every kernel of the wavefront gets the scene, in their order: ARGUMENT(type,
 * name), global arrays. Kernels, the struct that stages read (path/launch.h) and the host (runtime/render/wavefront)
 * expand this one list. */
#ifndef ITN_LAUNCH_ARGUMENTS_H
#define ITN_LAUNCH_ARGUMENTS_H

/* Stay as long as the geometry does. */
#define GEOMETRY_ARGUMENTS(ARGUMENT)          \
  ARGUMENT(const float, nodes)                \
  ARGUMENT(const float, leaves)               \
  ARGUMENT(const PrimitiveRecord, primitives) \
  ARGUMENT(const uint, grid)                  \
  ARGUMENT(const GeometryRecord, geometries)

/* texture_axes: of structures with BSDF_BUMPED, where there are some: of each primitive that is a triangle dp/du and dp/dv, in the
 * frame around its normal (model/shading_frame.h).
 * number_textures: beside `numbers`, the texture that takes a number's place, -1: none.
 * futures: [cell][throughput channel] (derivative/baseline.h); visits: of a pilot; pixel_adjoints, gradient,
 * texel_gradient: derivative/adjoint.h.
 * measured: tables of measured BSDFs (texture/measured.h).
 * samples: SAMPLE_SIZE floats each. misplaced: one count, arrivals at surfaces from the wrong side. endless: one
 * count, paths that were ended though the scene sets no max_depth. */
#define LAUNCH_ARGUMENTS(ARGUMENT)                \
  GEOMETRY_ARGUMENTS(ARGUMENT)                    \
  ARGUMENT(const float, texture_axes)             \
  ARGUMENT(const JobRecord, jobs)                 \
  ARGUMENT(const CameraRecord, cameras)           \
  ARGUMENT(const ShapeRecord, shapes)             \
  ARGUMENT(const BsdfRecord, bsdfs)               \
  ARGUMENT(const MediumRecord, media)             \
  ARGUMENT(const FieldRecord, fields)             \
  ARGUMENT(const float, voxels)                   \
  ARGUMENT(const float, numbers)                  \
  ARGUMENT(const int, number_textures)            \
  ARGUMENT(const EnvironmentRecord, environments) \
  ARGUMENT(const LightRecord, lights)             \
  ARGUMENT(const float, light_tables)             \
  ARGUMENT(const TextureRecord, textures)         \
  ARGUMENT(const float, texels)                   \
  ARGUMENT(const float, measured)                 \
  ARGUMENT(const DerivativeRecord, derivatives)   \
  ARGUMENT(const float, futures)                  \
  ARGUMENT(float, visits)                         \
  ARGUMENT(const float, pixel_adjoints)           \
  ARGUMENT(uint, gradient)                        \
  ARGUMENT(uint, texel_gradient)                  \
  ARGUMENT(float, samples)                        \
  ARGUMENT(uint, misplaced)                       \
  ARGUMENT(uint, endless)

#endif
