/* The declarations of models. A model is one file in model/<family>/ and one line in that folder's
 * list.h.
 *
 *   PREFIX_NUMBERS(NUMBER)         what the formulas take, in the order of the array n that they get:
 *     NUMBER(PREFIX, name, channels, role, coordinate)
 *   PREFIX_PARAMETERS(PARAMETER)   what people set, by Mitsuba's names, in the order in which name_numbers() takes
 *                                  them:
 *     PARAMETER(name, kind, fallback, unit)     kind: a kind of include/itn/parameter_kind.h
 *
 * Both lists expand to everything that knows the model: reading and checking of scenes, `itn parameters`, packing,
 * loading on the device, scores, gradients. A colour has three slots in n, of which a grey program (CHANNELS 1) loads
 * the first. */
#ifndef ITN_DECLARATION_H
#define ITN_DECLARATION_H
#include "shared/portable.h"

/* Throughput channels of the program; tests and recordings have all three. */
#ifdef THROUGHPUT_CHANNELS
#define CHANNELS THROUGHPUT_CHANNELS
#else
#define CHANNELS 3
#endif

#ifndef __OPENCL_VERSION__
/* One interface a family: not every model looks at every argument. */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

/* Slots of a model's numbers: n[PREFIX_name], or n[PREFIX_name + c] of a colour. */
#define DECLARE_SLOT(PREFIX, name, channels, role, coordinate) \
  PREFIX##_##name, PREFIX##_##name##_last = PREFIX##_##name + (channels)-1,

/* Roles of a number:
 *   ROLE_FACTOR    a factor of the throughput; no score of a density that is sampled is asked for by it
 *   ROLE_DENSITY   sampled densities depend on it, and their score quiets derivatives (derivative/baseline.h)
 *   ROLE_INDEX     sampled densities depend on it, but with a score of infinite variance (at the critical angle)
 *   ROLE_FIXED     nothing is differentiated by it
 *   ROLE_NORMAL    a direction, of which grey programs have all three channels, too; differentiated by texels alone
 *   ROLE_BUMP      as ROLE_NORMAL, made of the slopes of its texture (scattering/bump.h), which scores by it are by
 *   ROLE_TINT      of a light, what multiplies its colour; differentiated by texels alone */
enum { ROLE_FACTOR, ROLE_DENSITY, ROLE_INDEX, ROLE_FIXED, ROLE_NORMAL, ROLE_BUMP, ROLE_TINT };

/* The coordinates by which gradients by replay are taken (derivative/adjoint.h), so that all are of order 1: d
 * coordinate = d number / scale.
 *   COORDINATE_LOG      scale: the number, which is positive
 *   COORDINATE_COSINE   scale: 1 - number^2, of a number in (-1, 1)
 *   COORDINATE_ITSELF   scale: 1, of a number of either sign and of order 1 */
enum { COORDINATE_LOG, COORDINATE_COSINE, COORDINATE_ITSELF };

/* Traits of BSDFs.
 *   BSDF_TRANSMITS   a boundary that light passes: wi and wo are on either side, and no twosided one is needed
 *   BSDF_SMOOTH      all its directions are chosen, not drawn from a density: light is not sampled
 *   BSDF_PARTLY_SMOOTH   some of its directions are chosen: light is sampled for the others
 *   BSDF_THIN        it has no inside: its shapes need not be closed
 *   BSDF_EVEN        a sample's weight depends on wi alone, so that roulette can be played before light is sampled
 *   BSDF_BASELINE    its decisions quiet derivatives
 *   BSDF_ANISOTROPIC   the x axis of its frame follows the first texture coordinate. Scene files mean it by the type that
 *                    it shares with an isotropic one, where they give two alphas that differ
 *   BSDF_STRUCTURE   made for the scene of what its XML nests (model/nest): its leaves tell the sides of the surface apart
 *   BSDF_PASSES      a structure that lets part of the light pass straight on, as an index-matched boundary does
 *   BSDF_BUMPED      a structure whose normals depend on the slopes of textures
 *   BSDF_BROAD       it transmits, and has lobes so broad that all light is sampled for them, not the sun and lights
 *                    alone
 *   BSDF_MEASURED    some of its numbers are values of a table for the two directions, looked up before its functions are
 *                    called (texture/measured.h) */
#define BSDF_TRANSMITS 1
#define BSDF_SMOOTH 2
#define BSDF_EVEN 4
#define BSDF_BASELINE 8
#define BSDF_PARTLY_SMOOTH 16
#define BSDF_THIN 32
#define BSDF_ANISOTROPIC 64
#define BSDF_STRUCTURE 128
#define BSDF_PASSES 256
#define BSDF_BUMPED 512
#define BSDF_BROAD 1024
#define BSDF_MEASURED 2048

/* Traits of lights.
 *   LIGHT_ON_SHAPE   it is the surface of a shape, which paths find by chance, too
 *   LIGHT_TINTED     its three numbers behind the colour are another colour, or a texture, that multiplies what
 *   arrives
 *   LIGHT_BEAM       it stands in a flat shape, which tells its place, but has no extent in directions: no path finds it by
 *                    chance
 *   LIGHT_PARALLEL   it comes from the same direction everywhere */
#define LIGHT_ON_SHAPE 1
#define LIGHT_TINTED 2
#define LIGHT_BEAM 4
#define LIGHT_PARALLEL 8

/* A distance that leads out of every scene [scene unit]. */
#define FAR_AWAY 1e30f

#endif
