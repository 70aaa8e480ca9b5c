// The models that the scenes of a launch have, as the texts that the program takes in the place of
// kernels/program/surfaces.h and structures.h.
#pragma once
#include <string>
#include <vector>

#include "runtime/render/compile/launch_data.h"

namespace itn {

// A BSDF and the value of its `distribution`: paths at surfaces of a kind wait in a queue of their own.
struct SurfaceKind {
  const Model* model = nullptr;
  int variant = 0;
};

// The kinds that there may be beside structures; the number of a kind is its position here + 1, that of a structure its
// model's.
const std::vector<SurfaceKind>& surface_kinds();
int surface_number(const Model& model, int variant);

// The surface kinds of the launch, in their order: the number of a kind in its program is its position here + 1.
std::vector<SurfaceKind> surfaces_of(const LaunchData& data);

// The launch's BSDFs with the numbers of its program in BsdfRecord::surface.
std::vector<BsdfRecord> numbered_bsdfs(const LaunchData& data);

// The stages of the program's queues (kernels/shared/path_state.h), by their kernels' names.
std::vector<std::string> stages_of(const LaunchData& data);

// The models that the launch has. Media: all, since stages that end connections name theirs, be there one or not.
struct ModelsOfLaunch {
  std::vector<const Model*> bsdfs, structures, media, phases, lights, environments;
};
ModelsOfLaunch models_of(const LaunchData& data);

// The launch's models that are made for scenes: structures, mixtures of phase functions, and tables, also those inside
// of mixtures.
std::vector<const Model*> made_models(const LaunchData& data);

// Number of words behind a model's numbers that say which colours of textures they are (kernels/texture/numbers.h).
int origin_words(const LaunchData& data);

std::string surfaces_text(const LaunchData& data);
// The same for kernels/program/structures.h.
std::string structures_text(const LaunchData& data);

}  // namespace itn
