/* The light that surrounds a scene, as the device reads it: one record an environment, so that jobs with different light
 * share a launch. Whatever grows with the input (pixels, sampling tables) lies in one shared array of floats that the
 * record points into. Included by C++ and by OpenCL C: floats and ints only. */
#ifndef ITN_ENVIRONMENT_LAYOUT_H
#define ITN_ENVIRONMENT_LAYOUT_H

/* Traits. ENVIRONMENT_EVEN: chance finds it as well as sampling would */
#define ENVIRONMENT_EVEN 1

/* Rows and columns of the sampling table over the sky's hemisphere: rows are bounded by equal steps of sqrt(cos theta),
 * where the horizon's gradient needs them; columns are equal steps of azimuth counted from the sun. */
#define SKY_ROWS 32
#define SKY_COLUMNS 64

/* Coefficients of the sky: a channel has SKY_COEFFICIENTS of them, A B C D E F G I H and the mean radiance. */
#define SKY_COEFFICIENTS 10

/* The sun's limb: six powers of mu, and Hermite data of each (value, slope) at SUN_KNOTS elevations. */
#define SUN_POWERS 6
#define SUN_KNOTS 46

/* Offsets count floats in light_tables. local = to_local * world (row major); z is up for sunsky, y for an envmap. */
typedef struct {
  int model;         /* MODEL_*, MODEL_none: it is dark */
  int values;        /* envmap: rgb, row 0 on top, width + 1 columns: the last repeats the first;
                        spherical harmonics: rgb of each coefficient */
  int width, height; /* envmap; width: order of spherical harmonics */
  int sampling; /* but of even light: cumulative rows (rows + 1), then cumulative columns, row by row (columns + 1 each) */
  int sun_table;   /* sun with limb darkening: [knot][channel][power][value, slope] */
  int complex_sun; /* 0 or 1 */
  float
      concentration; /* envmap: 4 pi times the integral of its luminance's square over the square of the integral: 1 where it is even; else 0 */
  int gradient;      /* envmap: where the sums by its pixels begin (derivative/adjoint.h); -1: nobody asks for them */
  float to_local[9];
  float radiance[3]; /* constant; envmap: what its pixels are multiplied by */
  float sky[3 * SKY_COEFFICIENTS];
  float sun_radiance[3];  /* without limb darkening */
  float sun_direction[3]; /* world, unit, towards the sun */
  float sun_tangent[3];   /* world; tangent, bitangent and direction are orthonormal */
  float sun_bitangent[3];
  float sun_local[3];                     /* sun_direction in the local frame */
  float sun_azimuth_cos, sun_azimuth_sin; /* of sun_local: (1, 0) when the sun stands in the zenith */
  float sun_cos;                          /* of the half angle */
  float sun_one_minus_cos;                /* 1 - sun_cos, computed without cancellation */
  float sun_chord2;                       /* |d - s|^2 <= sun_chord2 inside the disc: 2 (1 - sun_cos) */
  float sun_pdf;                          /* 1 / solid angle [1/sr]; 0 without a sun */
  float sun_weight,
      sky_weight; /* luminance integrated over the sphere of directions: for the share of lights of the scene beside it */
} EnvironmentRecord;

typedef char environment_record_is_296_bytes[sizeof(EnvironmentRecord) == 296 ? 1 : -1];

#endif
