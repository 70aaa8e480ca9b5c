/* All models, numbered: one number each, whatever the family. */
#ifndef ITN_MODELS_H
#define ITN_MODELS_H
#include "model/bsdf/list.h"
#include "model/environment/list.h"
#include "model/light/list.h"
#include "model/medium/list.h"
#include "model/phase/list.h"

#define NUMBER_BSDF(name, PREFIX, type, variants) MODEL_##name,
#define NUMBER_MODEL(name, PREFIX, type) MODEL_##name,
enum {
  MODEL_none,
  MEDIUM_LIST(NUMBER_MODEL) PHASE_LIST(NUMBER_MODEL) BSDF_LIST(NUMBER_BSDF) LIGHT_LIST(NUMBER_MODEL)
      ENVIRONMENT_LIST(NUMBER_MODEL) MODELS
};

/* Room for the numbers of any one model. Programs are told how much their own models need. */
#ifndef MOST_SLOTS
#define ROOM_BSDF(name, PREFIX, type, variants) char name[PREFIX##_SLOTS + 1];
#define ROOM_MODEL(name, PREFIX, type) char name[PREFIX##_SLOTS + 1];
typedef union {
  BSDF_LIST(ROOM_BSDF) MEDIUM_LIST(ROOM_MODEL) PHASE_LIST(ROOM_MODEL) LIGHT_LIST(ROOM_MODEL)
} NumbersOfAnyModel;
#define MOST_SLOTS ((int)sizeof(NumbersOfAnyModel))
#endif
/* Numbers that a texture may stand for are in the first slots of their model. */
#define TEXTURED_SLOTS 16

#endif
