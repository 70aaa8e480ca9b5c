/* A path between two stages: one float or int a field, fields[FIELD * stride + slot]; and the queues it can wait in.
 * Features that a scene does not use (definitions of the program, see runtime/render/compile/launch_data.cpp) take no room. */
#ifndef ITN_PATH_STATE_H
#define ITN_PATH_STATE_H

/* FIELD(name, size): size fields, whose first is called name.
 *   POSITION
 *   DIRECTION         unit, of travel from the camera on
 *   THROUGHPUT        without the refraction scale below
 *   RADIANCE          gathered so far
 *   DERIVATIVE        of the radiance: RADIANCE_CHANNELS for each of DERIVATIVES
 *   OTHER_ALBEDO      the radiance with each of ALBEDOS other albedos (derivative/score.h)
 *   SCORE             see ScoreRecord
 *   BASELINE          THROUGHPUT_CHANNELS each (derivative/baseline.h)
 *   PROBE_PASSED, PROBE_TARGET   scattering/probe.h: ProbeState
 *   PROBE_WEIGHT      what the probe's path will weigh what it gathers with
 *   REFRACTION_SCALE  (n here / n at the camera)^-2: radiance over basic radiance
 *   PIXEL, SAMPLE     ints: with the job's seed and EVENT the counter of the random numbers
 *   DEPTH             scatterings so far, surfaces and media, index-matched boundaries not counted
 *   MEDIUM            current medium, -1: vacuum
 *   SKIP              primitive the path stands on, -1: none
 *   PASSED            1: it went straight on through SKIP, an index-matched boundary, and looks ahead only: with
 *                     tolerances for where it stands, a body thinner than these would be entered and left for ever
 *   HIT               primitive it has arrived at
 *   HIT_PLACE         barycentric (triangle), phase etc.: see trace.h
 *   LAST_PDF          see light_sampling.h
 *   TOTAL             derivative/adjoint.h: what the whole path gathers, 0 unless it is replayed
 *   PIXEL_ADJOINT     adjoint of its pixel: what its derivatives are weighed with
 *   TOTAL_BASELINE    what BASELINE ends as
 *   PROBE_PLACE, PROBE_FIELD   where it was, -1: nowhere yet
 *   SPECTRAL_WEIGHT, HERO   see path/launch.h
 *   ARRIVAL           waiting in QUEUE_CONNECT: direction of travel before the scattering; on arrival at a boundary:
 *                     where the last flight began
 *   ORIGIN            where the path last changed its direction
 *   LAST_PDF_DIVISOR  what LAST_PDF was divided by for the sun's sake (stage/boundary.h); negative: ORIGIN is an exit
 *   EXIT_*            of the flight that ended at that exit: where it began, its density there times that of its direction,
 *                     over the chance of a connection, and its medium
 *   CHANCE            waiting in QUEUE_CONNECT: the probability with which it got there */
#define PATH_STATE(FIELD)                                             \
  FIELD(POSITION, 3)                                                  \
  FIELD(DIRECTION, 3)                                                 \
  FIELD(THROUGHPUT, THROUGHPUT_CHANNELS)                              \
  FIELD(RADIANCE, RADIANCE_CHANNELS)                                  \
  FIELD(DERIVATIVE, DERIVATIVES* RADIANCE_CHANNELS)                   \
  FIELD(OTHER_ALBEDO, ALBEDOS* RADIANCE_CHANNELS)                     \
  FIELD(SCORE, SCORES)                                                \
  FIELD(BASELINE, BASELINES*(SCORES + ADJOINT) * THROUGHPUT_CHANNELS) \
  FIELD(PROBE_PASSED, (VOXEL_SUMS > 0))                               \
  FIELD(PROBE_TARGET, (VOXEL_SUMS > 0))                               \
  FIELD(PROBE_WEIGHT, (VOXEL_SUMS > 0) * RADIANCE_CHANNELS)           \
  FIELD(REFRACTION_SCALE, 1)                                          \
  FIELD(PIXEL, 1)                                                     \
  FIELD(SAMPLE, 1)                                                    \
  FIELD(EVENT, 1)                                                     \
  FIELD(DEPTH, 1)                                                     \
  FIELD(MEDIUM, 1)                                                    \
  FIELD(SKIP, 1)                                                      \
  FIELD(PASSED, 1)                                                    \
  FIELD(HIT, 1)                                                       \
  FIELD(HIT_PLACE, 2)                                                 \
  FIELD(LAST_PDF, 1)                                                  \
  FIELD(JOB, 1)                                                       \
  FIELD(TOTAL, ADJOINT* RADIANCE_CHANNELS)                            \
  FIELD(PIXEL_ADJOINT, ADJOINT* RADIANCE_CHANNELS)                    \
  FIELD(TOTAL_BASELINE, ADJOINT* BASELINES* THROUGHPUT_CHANNELS)      \
  FIELD(PROBE_PLACE, 3 * (VOXEL_SUMS > 0))                            \
  FIELD(PROBE_FIELD, (VOXEL_SUMS > 0))                                \
  FIELD(SPECTRAL_WEIGHT, 3 * SPECTRAL)                                \
  FIELD(HERO, SPECTRAL)                                               \
  FIELD(ARRIVAL, 3 * MEDIUM_LIGHT_SAMPLING)                           \
  FIELD(CHANCE, MEDIUM_LIGHT_SAMPLING)                                \
  FIELD(ORIGIN, 3 * HAS_AREA_LIGHTS * LIGHT_SAMPLING)                 \
  FIELD(LAST_PDF_DIVISOR, HAS_AREA_LIGHTS* ROUGH_LIGHT_SAMPLING)      \
  FIELD(EXIT_VERTEX, 3 * HAS_AIMED_SHAPES)                            \
  FIELD(EXIT_DENSITY, HAS_AIMED_SHAPES)                               \
  FIELD(EXIT_MEDIUM, HAS_AIMED_SHAPES)

#ifdef __OPENCL_VERSION__
#define NUMBER_FIELD(name, size) name, LAST_OF_##name = name + (size)-1,
enum { PATH_STATE(NUMBER_FIELD) FIELDS };
#endif

/* In the OPERATOR_SINGLE build DEPTH also holds, above the count of scatterings, whether the path has scattered in a
 * medium. */
#define SCATTERED_ONCE 0x40000000

/* Scenes without max_depth end paths there, and count them as endless: half of SCATTERED_ONCE, which takes minutes and is
 * beyond what leaves a body of 10^4 mean free paths; STUCK_DEPTH where paths go nowhere. */
#define STUCK_DEPTH 0x10000
#define MOST_DEPTH 0x20000000

/* QUEUE(NAME, stage). Those of surfaces come last: QUEUE_SURFACE, then one for each kind of surface that the scene has
 * (SURFACE_LIST of the program, runtime/render/compile/surfaces.h).
 *   FREE      slots without a path
 *   RAY       in vacuum: to the next surface
 *   MEDIUM    free flights and scatterings to the next boundary
 *   CONNECT   at a scattering vertex that light is to be connected with; then on in the medium
 *   ESCAPE    left the scene
 *   SURFACE   at an index-matched boundary */
#define QUEUE_LIST(QUEUE) \
  QUEUE(FREE, generate)   \
  QUEUE(RAY, ray)         \
  QUEUE(MEDIUM, medium)   \
  QUEUE(CONNECT, connect) \
  QUEUE(ESCAPE, escape)   \
  QUEUE(SURFACE, null)

#define NUMBER_QUEUE(NAME, stage) QUEUE_##NAME,
enum { QUEUE_LIST(NUMBER_QUEUE) QUEUES_BUT_SURFACES };
/* One for each of the program's surfaces beside null. */
#define QUEUES (QUEUES_BUT_SURFACES + SURFACES)

#endif
