/* The device's records of a scene beside geometry (geometry_layout.h) and light (environment_layout.h): plain, the same
 * bytes on host and device. Indices are absolute positions in the arrays of a launch, which may hold several
 * scenes. */
#ifndef ITN_SCENE_LAYOUT_H
#define ITN_SCENE_LAYOUT_H

/* A film position (a, b), a = 1 - 2 x / width, b = 1 - 2 y / height, sees the ray
 *   origin = origin_0 + a origin_a + b origin_b, direction ~ direction_0 + a direction_a + b direction_b.
 * HAS_DISTORTION: where slope_a is not 0, (a, b) is first moved to where an ideal camera sees it (model/sensor/opencv.h).
 * HAS_LENS: and l, uniform over the disk with the half axes lens_a and lens_b, moves it:
 *   origin += lens_start l, direction -= lens_turn l.
 * HAS_ZONE: or rays begin on a surface, uniform over its area, and leave its front in proportion to the cosine; or they go
 *   along direction_0, through points of the surface, from `before` in front of it.
 * HAS_FAR_CLIP: it sees what is nearer than 1 / dot(clip, unit direction) and, where that is nothing, the light around; in a
 *   medium, no light. */
typedef struct {
  float origin_0[3], origin_a[3], origin_b[3];
  float direction_0[3], direction_a[3], direction_b[3];
  float lens_a[3], lens_b[3], lens_start, lens_turn;
  float distortion[8];      /* k1 to k6, p1, p2 */
  float middle_a, middle_b; /* of the axis on the film */
  float slope_a, slope_b;   /* a and b in units of the focal length; 0: no distortion */
  float clip[3];            /* 0: all of the scene is nearer */
  float before[3];
  int table, surfaces; /* of the surface (shared/light_layout.h); 0: there is none */
  int measures;        /* 1: irradiance; the cosine is in the density, and what is left of the integral is pi */
  float inverse_width, inverse_height; /* of the whole film [1/pixel] */
  int crop_x, crop_y, crop_width;      /* pixel i of a job is (crop_x + i % crop_width, crop_y + i / crop_width) */
  int crop_height;
  float
      filter_reach; /* HAS_FILM_EDGES: of the filter, beyond which no position lies [pixel]; 0: it may reach beyond the film */
  int filter;        /* FILTER_* */
  float filter_size; /* tent: radius, gaussian: standard deviation [pixel] */
  int medium;        /* -1: vacuum */
} CameraRecord;

enum { FILTER_BOX, FILTER_TENT, FILTER_GAUSSIAN };

enum { CONNECTION_NONE, CONNECTION_STRAIGHT, CONNECTION_REFRACTED };

/* Its numbers are n = numbers + first_number of the launch, those of its phase function numbers + first_phase_number.
 * */
typedef struct {
  int model, first_number; /* MODEL_* of model/models.h */
  int phase, first_phase_number;
  int connection;                      /* CONNECTION_*: how light reaches its scattering vertices */
  int distribution;                    /* refracted: MICROFACET_* of the boundary that the guess assumes */
  float alpha, eta;                    /* refracted: of that boundary, eta inside over outside */
  int first_cell;                      /* of the table of expected futures (derivative/baseline.h) */
  int field, albedo_field;             /* what sigma_t and albedo are times, -1: the same everywhere */
  int first_phase_field, phase_fields; /* what stands for numbers of the phase function: so many, one after the other */
  int sample_emitters; /* 0: lights without extent do not shine on its scattering vertices, as in Mitsuba */
} MediumRecord;

typedef struct {
  int bsdf;
  int interior, exterior; /* media, -1: vacuum */
  int light;              /* of the launch, -1: it does not shine, -2: a beam leaves it, which paths do not find */
} ShapeRecord;

typedef struct {
  int surface;  /* SURFACE_NULL, or which of the program's surfaces: its queue is QUEUE_SURFACE + surface */
  int twosided; /* a BSDF that does not transmit: the same on both sides */
  int first_number;
  int first_cell; /* as of a medium */
} BsdfRecord;
#define SURFACE_NULL 0

/* Texels are float rgb, row 0 at v = 0, in one array for all textures. */
enum { TEXTURE_REPEAT, TEXTURE_MIRROR, TEXTURE_CLAMP };

/* A texture of a number stands for it. A number that is textured by colours has sets of its model's numbers behind its
 * own: colour k, from 1 on, of the texture of number[0] is number[k * numbers]. */
typedef struct {
  int kind; /* TEXTURE_* of model/texture/list.h */
  float to_uv[6];
  int numbers;               /* of the model */
  int offset, width, height; /* bitmap, mesh_attribute, volume: see there */
  int wrap;                  /* TEXTURE_REPEAT ... */
  int nearest;               /* else bilinear */
  int gradient;              /* where the sums by its texels begin (derivative/adjoint.h); -1: nobody asks for them */
} TextureRecord;

enum { BRICK_BITS = 3, BRICK = 1 << BRICK_BITS }; /* voxels along each axis */

/* A field (texture/field.h): voxels of one channel or three, x fastest, channels interleaved, and over the box that they fill
 * a coarse grid of the greatest and least values of its cells, both in one array of floats. Packed voxels
 * (runtime/scene/volume/packed_voxels.h) are bricks: the numbers of those stored, in the order of voxels, and the stored ones. */
typedef struct {
  float low[3], high[3]; /* the box; outside of it extinction is 0 */
  float to_voxels[12];   /* rows of an affine map; voxel i reaches from i to i + 1 */
  float cell_size[3];
  int size[3], cells[3];
  int channels;
  int wrap;    /* TEXTURE_REPEAT ... */
  int nearest; /* else linear */
  int first_voxel, first_cell;
  int first_brick; /* where the numbers of packed bricks begin; -1: not packed */
  int bricks[2];   /* along x and y */
  int bits;        /* 8 or 16: a value is lowest + step * number; 32: a float */
  float lowest, step;
  float mean;   /* value */
  int gradient; /* where the sums by its voxels begin (derivative/voxel_gradient.h); -1: nobody asks for them */
  int sum;      /* which of the sums over all voxels of a field is its */
  int slot;     /* of a phase function: it is n[slot] */
} FieldRecord;

/* A number of a scene that factors of a path's throughput depend on: the path carries its score, the sum of
 * d log f / d number over the factors so far. Several numbers of one model (model/models.h) may be n[slot]. */
typedef struct {
  int model, slot;
  int channel; /* of the throughput whose factors these are */
  int first;   /* n = numbers + the job's first_number + first */
  int origin;  /* where the number shows: 0: as it is; k: where it is colour k of a texture */
} ScoreRecord;

/* Gradients by replay are by numbers[first + slot] of every n of a model: which slots are summed, and in which channel
 * of the throughput; -1: in all. */
typedef struct {
  int model, slot, channel;
  int origin; /* as of ScoreRecord */
  int at;     /* the number is numbers[first + at] */
  int texels; /* -1, or the first slot of the number: by the texels of its textures, too, and by the number itself
                 instead of its coordinate. A direction has three slots, each in all channels, and what a bump map's
                 heights make of it two: by their slopes */
} SumRecord;

/* A derivative of the image is a sum of parts, one for each medium, BSDF or light that the parameter is a number of:
 * d f / d parameter = f * factor[c] * score[c] in channel c, or for a parameter of the light f / radiance * d radiance
 * / d parameter. A PartRecord is known when the program is built, a DerivativeRecord changes with the scene. */
typedef struct {
  int image;    /* which derivative it is a part of */
  int score[3]; /* -1: the channel does not depend on it */
} PartRecord;

typedef struct {
  float factor[3]; /* d number / d parameter */
  int environment; /* of the light around the scene: the record of d radiance / d parameter (light/emission.h); else -1 */
  int light;       /* of a light of the scene: where its numbers begin; else -1 */
  float colour[3]; /* d its colour / d parameter */
} DerivativeRecord;

/* Paths are traced again, whose samples are there already: for the sums of the gradient (derivative/adjoint.h), or for what
 * probes add to it (scattering/probe.h). */
enum { REPLAY_SUMS = 1, REPLAY_PROBES = 2 };
#define PROBES 4 /* of a path */

/* One image with one set of parameters. */
typedef struct {
  int camera, geometry, environment;
  int first_shape;         /* shape k of the geometry is shapes[first_shape + k] */
  int first_number;        /* of the scene, for ScoreRecord */
  int first_exponent;      /* of other albedos: derivative/score.h */
  int first_light, lights; /* of the scene */
  float light_share;       /* with which one of these is sampled, and not the light around the scene */
  int light_chances;       /* which one, by place: light_layout.h */
  int light_cells[3];
  float light_low[3], light_cells_a_unit[3];
  int max_depth;  /* a path with k scatterings counts if k < max_depth */
  int is_endless; /* 1: the scene sets none, and paths that max_depth ends are counted */
  int is_stuck;   /* 1: positions are too coarse for a medium's flights, so that paths go nowhere */
  int rr_depth;
  int hide_emitters; /* 1: a path that has not scattered sees no light, and goes through shapes that shine, as in Mitsuba */
  int first_pixel;  /* of this launch */
  int pixel_step;   /* from a pixel of this launch to the next */
  int first_sample; /* of this launch */
  int samples;      /* a pixel in this launch */
  /* Sample s of pixel p is written at first_output + (p - first_pixel) / pixel_step * samples + s - first_sample. */
  int first_output;
  unsigned int seed_low, seed_high;
  float future_tint[3]; /* of the expected futures, where a throughput channel stands for several of radiance */
  int pilot;            /* 1: paths tell what they visit */
  int replay;           /* REPLAY_*; else samples are traced for the first time */
  /* Replay: pixel p's adjoints are at first_pixel_adjoint + (p - first_pixel) / pixel_step, one a channel. */
  int first_pixel_adjoint;
  int probe; /* of REPLAY_PROBES: which of the path's, from 0 */
  /* Replay: a pixel's set is one of set_mask + 1 from first_set on, of `sets` that a work-item sums in, or all share. */
  int sets, first_set, set_mask;
  int contrast; /* 1: not to the sums by texels */
} JobRecord;

/* Gradients (derivative/adjoint.h) are summed in sets of pixels of their own, as [set][number][radiance channel]: the launch's
 * numbers, then each parameter of the light, then each field, by all of its voxels. The first GRADIENT_SETS make up the
 * gradient, so many that work-items that share them seldom wait for each other; those of contrasts, whose spread tells
 * the noise (include/itn/gradient_renderer.h), follow. */
#define GRADIENT_SETS 32
#define MOST_CONTRAST_SETS 256

/* A run of paths of one job that one pool works off: the unit of load balancing. */
typedef struct {
  int job;
  int first,
      count; /* path i of the job: pixel first_pixel + i / samples * pixel_step, sample first_sample + i % samples */
  int start; /* paths in the chunks before this one */
} ChunkRecord;

#endif
