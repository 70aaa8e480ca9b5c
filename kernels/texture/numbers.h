/* The numbers n of models, of each lane's own instance, and what their declarations say of them. All functions are
 * given a constant `model`, so that the lists fold to the lines of that model. */
#ifndef ITN_NUMBERS_H
#define ITN_NUMBERS_H
#include "path/launch.h"
#include "texture/texture_places.h"
#include "model/nest/list.h"
#include "program/structures.h"
#include "program/surfaces.h"

#define MODELS_OF_SCENE(MODEL) \
  BSDFS_OF_SCENE(MODEL)        \
  STRUCTURES_OF_SCENE(MODEL) MEDIA_OF_SCENE(MODEL) PHASES_OF_SCENE(MODEL) LIGHTS_OF_SCENE(MODEL)

/* The colours of textures that the numbers are: two bits a slot, in the places behind them; 0: not one of a texture.
 * Numbers that a texture may stand for are declared before all others, in the slots that have bits; programs with
 * structures, where this cannot be, have several words of them. */
#define ORIGINS (MOST_SLOTS - ORIGIN_WORDS)
#define ORIGIN_BITS 2
#define SLOTS_OF_A_WORD 16

/* One number, of up to three channels; uv: where its texture is looked up, as surface_frame() says. TEXTURED: has some instance one there? */
__attribute__((always_inline)) INLINE void load_number(const Launch* launch, int model, int slot, int channels,
                                                       int role, INT first, const REAL uv[2], REAL n[]) {
  const int loaded = channels == 1 ? 1 : role == ROLE_NORMAL || role == ROLE_BUMP ? 3 : CHANNELS;
  n[slot] = GATHER((launch->numbers + slot), first);
  if (loaded == 3) {
    n[slot + 1] = GATHER((launch->numbers + slot + 1), first);
    n[slot + 2] = GATHER((launch->numbers + slot + 2), first);
  }
#if HAS_TEXTURE
  if (!TEXTURED(model, slot)) return;
  Lanes at, value[3], origin;
  const TexturePlaces places = texture_places(uv);
  at.integer = first;
  origin.integer = (INT)(0);
  UNROLL_FOR(int c = 0; c < loaded; ++c) value[c].real = n[slot + c];
  UNROLL_FOR(int l = 0; l < WIDTH; ++l) {
    const int texture = launch->number_textures[at.i[l] + slot];
    if (texture < 0) continue;
    float rgb[3];
    const TexturePlace place = texture_place_of(launch, &places, l);
    if (role == ROLE_BUMP)
      texture_slopes(launch->textures + texture, launch->texels, place.u, place.v, rgb);
    else
      origin.i[l] =
          texture_value(launch->textures + texture, launch->texels, launch->numbers + at.i[l] + slot, place, rgb);
    UNROLL_FOR(int c = 0; c < loaded; ++c) value[c].f[l] = rgb[c];
  }
  UNROLL_FOR(int c = 0; c < loaded; ++c) n[slot + c] = value[c].real;
  UNROLL_FOR(int c = 0; c < channels; ++c) {
    const int word = ORIGINS + (slot + c) / SLOTS_OF_A_WORD, bit = ORIGIN_BITS * ((slot + c) % SLOTS_OF_A_WORD);
    n[word] = AS_REAL(AS_INT(n[word]) | origin.integer << bit);
  }
#endif
}

#define LOAD_NUMBER(PREFIX, name, channels, role, coordinate) \
  load_number(launch, model, PREFIX##_##name, channels, role, first, uv, n);
#define LOAD_MODEL(name, PREFIX) \
  case MODEL_##name: PREFIX##_NUMBERS(LOAD_NUMBER) break;
__attribute__((always_inline)) INLINE void load_numbers(const Launch* launch, int model, INT first, const REAL uv[2],
                                                        REAL n[]) {
#if HAS_TEXTURE
  UNROLL_FOR(int word = 0; word < ORIGIN_WORDS; ++word) n[ORIGINS + word] = (REAL)(0.0f);
#endif
  switch (model) { MODELS_OF_SCENE(LOAD_MODEL) }
}

/* origins: n[ORIGINS] and the words behind it. Is n[slot] what a record says that has this `origin`? */
INLINE REAL where_from(const INT origins[], int slot, int origin, REAL d) {
#if HAS_TEXTURE
  if (slot >= ORIGIN_WORDS * SLOTS_OF_A_WORD) return origin == 0 ? d : (REAL)(0.0f);
  const INT own = origins[slot / SLOTS_OF_A_WORD] >> (ORIGIN_BITS * (slot % SLOTS_OF_A_WORD));
  return SELECT((own & ((1 << ORIGIN_BITS) - 1)) == origin, d, 0.0f);
#else
  return d;
#endif
}

/* ROLE_* of n[slot]. */
#define ROLE_OF_NUMBER(PREFIX, name, channels, role, coordinate) \
  if (slot >= PREFIX##_##name && slot <= PREFIX##_##name##_last) return role;
#define ROLE_IN_MODEL(name, PREFIX) \
  case MODEL_##name: PREFIX##_NUMBERS(ROLE_OF_NUMBER) break;
__attribute__((always_inline)) INLINE int role_of(int model, int slot) {
  switch (model) { MODELS_OF_SCENE(ROLE_IN_MODEL) }
  return ROLE_FIXED;
}

/* d by n[slot] as d by its coordinate (shared/declaration.h), or `itself`. There is none by a logarithm of 0, nor where
 * such a number, which is a factor, lets nothing pass. */
#define LEAST_NUMBER 1e-18f
#define COORDINATE_OF_NUMBER(PREFIX, name, channels, role, coordinate)                       \
  if (slot >= PREFIX##_##name && slot <= PREFIX##_##name##_last)                             \
    return coordinate == COORDINATE_ITSELF   ? d                                             \
           : coordinate == COORDINATE_COSINE ? (itself ? d : d * (1.0f - n[slot] * n[slot])) \
           : itself                          ? SELECT(n[slot] > LEAST_NUMBER, d, 0.0f)       \
                                             : SELECT(n[slot] > 0.0f, d * n[slot], 0.0f);
#define COORDINATE_IN_MODEL(name, PREFIX) \
  case MODEL_##name: PREFIX##_NUMBERS(COORDINATE_OF_NUMBER) break;
__attribute__((always_inline)) INLINE REAL by_coordinate(int model, int slot, const REAL n[], REAL d, bool itself) {
  switch (model) { MODELS_OF_SCENE(COORDINATE_IN_MODEL) }
  return d;
}

#endif
