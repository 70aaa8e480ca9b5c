/* A path between two stages: one float or int a field, fields[FIELD * stride + slot]; and the queues it can wait in.
 * Features that a scene does not use (definitions of the program, see runtime/wavefront/launch_data.cpp) take no room. */
#ifndef ITN_PATH_STATE_H
#define ITN_PATH_STATE_H

/* Fields of a program with these definitions, for the host. */
#define PATH_FIELDS(throughput_channels, radiance_channels, spectral, medium_light_sampling, scores, derivatives, \
                    baselines, adjoint)                                                                           \
  (19 + (throughput_channels) * (1 + (baselines) * ((scores) + 2 * (adjoint))) +                                 \
   (radiance_channels) * (1 + (derivatives) + 2 * (adjoint)) + (scores) + 4 * (spectral) + 4 * (medium_light_sampling))

#ifdef __OPENCL_VERSION__
enum {
  POSITION_X, POSITION_Y, POSITION_Z,
  DIRECTION_X, DIRECTION_Y, DIRECTION_Z, /* unit, of travel from the camera on */
  THROUGHPUT, /* THROUGHPUT_CHANNELS fields; without the refraction scale below */
  RADIANCE = THROUGHPUT + THROUGHPUT_CHANNELS, /* RADIANCE_CHANNELS fields: gathered so far */
  DERIVATIVE = RADIANCE + RADIANCE_CHANNELS, /* of the radiance: RADIANCE_CHANNELS fields for each of DERIVATIVES */
  SCORE = DERIVATIVE + DERIVATIVES * RADIANCE_CHANNELS, /* SCORES fields: see ScoreRecord */
  BASELINE = SCORE + SCORES, /* if BASELINES: THROUGHPUT_CHANNELS fields each (lib/baseline.h) */
  REFRACTION_SCALE = BASELINE + BASELINES * (SCORES + ADJOINT) * THROUGHPUT_CHANNELS, /* (n here / n at the camera)^-2: radiance over basic radiance */
  PIXEL, SAMPLE, /* ints: with the job's seed and EVENT the counter of the random numbers */
  EVENT,
  DEPTH,  /* scatterings so far, surfaces and media, index-matched boundaries not counted */
  MEDIUM, /* current medium, -1: vacuum */
  SKIP,   /* primitive the path stands on, -1: none */
  PASSED, /* 1: it went straight on through SKIP, an index-matched boundary, and looks ahead only: with tolerances for where
             it stands, a body thinner than these would be entered and left for ever */
  HIT,    /* primitive it has arrived at */
  HIT_U, HIT_V, /* barycentric (triangle), phase etc. see trace.h */
  LAST_PDF, /* see light_sampling.h */
  JOB,
#if ADJOINT /* lib/adjoint.h */
  TOTAL, /* RADIANCE_CHANNELS fields: what the whole path gathers, 0 unless it is replayed */
  PULL = TOTAL + RADIANCE_CHANNELS, /* RADIANCE_CHANNELS fields: what its derivatives are weighed with */
  TOTAL_BASELINE = PULL + RADIANCE_CHANNELS, /* if BASELINES: THROUGHPUT_CHANNELS fields, what BASELINE ends as */
  LAST_OF_ADJOINT = TOTAL_BASELINE + BASELINES * THROUGHPUT_CHANNELS - 1,
#endif
#if SPECTRAL
  SPECTRAL_WEIGHT, /* 3 fields: see lib/launch.h */
  HERO = SPECTRAL_WEIGHT + 3,
#endif
#if MEDIUM_LIGHT_SAMPLING
  ARRIVAL_X, ARRIVAL_Y, ARRIVAL_Z, /* waiting in QUEUE_CONNECT: direction of travel before the scattering */
  VERTEX_X = ARRIVAL_X, VERTEX_Y, VERTEX_Z, /* on arrival at a boundary: where the last flight began */
  CHANCE, /* waiting in QUEUE_CONNECT: the probability with which it got there */
#endif
  FIELDS
};
typedef char path_fields_are_counted
    [FIELDS == PATH_FIELDS(THROUGHPUT_CHANNELS, RADIANCE_CHANNELS, SPECTRAL, MEDIUM_LIGHT_SAMPLING, SCORES, DERIVATIVES,
                           BASELINES, ADJOINT)
         ? 1
         : -1];
#endif

/* In the OPERATOR_SINGLE build DEPTH also holds, above the count of scatterings, whether the path has scattered in a medium. */
#define SCATTERED_ONCE 0x1000000

enum {
  QUEUE_FREE,   /* slots without a path */
  QUEUE_RAY,    /* in vacuum: to the next surface */
  QUEUE_NULL,   /* at an index-matched boundary */
  QUEUE_DIFFUSE,
  QUEUE_DIELECTRIC,
  QUEUE_ROUGH_BECKMANN,
  QUEUE_ROUGH_GGX,
  QUEUE_MEDIUM, /* in a participating medium: free flights and scatterings to the next boundary */
  QUEUE_CONNECT, /* at a scattering vertex that light is to be connected with; then on in the medium */
  QUEUE_ESCAPE, /* left the scene */
  QUEUES
};

#endif
