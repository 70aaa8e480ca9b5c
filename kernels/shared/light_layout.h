/* The lights that have a place in the scene (model/light), as the device reads them: one record each. Included by C++ and by
 * OpenCL C: floats and ints only.
 *
 * A light on a shape has a table in the shared array of floats: cumulative shares of its surfaces by area (surfaces + 1, see
 * light/environment.h), then LIGHT_SURFACE_SIZE floats a surface. Uniform over its area are the points
 *   triangle   place + s u + t v,               s, t >= 0, s + t <= 1; the normal is w
 *   disk       place + s u + t v,               s^2 + t^2 <= 1; the normal is w
 *   sphere     place + d, |d| = |u|;            the normal is d / |u| times side
 *   cylinder   place + s u + t v + h w,         s^2 + t^2 = 1, 0 <= h <= 1; the normal is (s u + t v) / |u| times side
 *
 * Which light is drawn depends on where it is needed: for each cell of a grid about the scene, x slowest, the same array has
 * cumulative shares of the job's lights (lights + 1), from light_chances of the job on. Outside, the nearest cell counts. */
#ifndef ITN_LIGHT_LAYOUT_H
#define ITN_LIGHT_LAYOUT_H

enum { LIGHT_TRIANGLE, LIGHT_DISK, LIGHT_SPHERE, LIGHT_CYLINDER };
enum {
  LIGHT_SURFACE_PLACE = 0,
  LIGHT_SURFACE_U = 3,
  LIGHT_SURFACE_V = 6,
  LIGHT_SURFACE_W = 9,
  LIGHT_SURFACE_KIND = 12,
  LIGHT_SURFACE_SIDE = 13,      /* 1, or -1: turned */
  LIGHT_SURFACE_OFFSET = 14,    /* how far in front of it connections end [scene unit] */
  LIGHT_SURFACE_PRIMITIVE = 15, /* int: of the launch; of lights with a texture alone */
  LIGHT_SURFACE_SIZE = 16
};

/* The ways in which bodies that refract find a light that stands outside or inside of them:
 *   AT_BOUNDARIES   where a path meets their boundary
 *   AIMED_AT        so, and from scattering vertices through rough boundaries (stage/connect.h)
 *   INSIDE          it may stand inside of one: from scattering vertices straight, and at boundaries on both sides */
enum { LIGHT_AT_BOUNDARIES, LIGHT_AIMED_AT, LIGHT_INSIDE };

typedef struct {
  int model;          /* MODEL_* of model/models.h */
  int first_number;   /* n = numbers + first_number of the launch */
  int table;          /* on a shape */
  int surfaces;       /* of the shape; 0: it is on none */
  float inverse_area; /* density of its points [1/scene unit^2] */
  int reach;          /* LIGHT_AT_BOUNDARIES ... */
} LightRecord;

#endif
