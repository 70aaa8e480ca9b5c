#include "runtime/compile/surfaces.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "kernels/shared/path_state.h"

namespace itn {
namespace {

std::string capitals(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::toupper(c); });
  return name;
}

std::set<int> numbers_of(const LaunchData& data) {
  std::set<int> numbers;
  for (const BsdfRecord& bsdf : data.bsdfs) numbers.insert(bsdf.surface);
  return numbers;
}

}  // namespace

const std::vector<SurfaceKind>& surface_kinds() {
  static const std::vector<SurfaceKind> all = [] {
    std::vector<SurfaceKind> kinds;
    for (const Model& model : bsdf_models())
      for (int variant = 0; variant < static_cast<int>(model.variants.size()); ++variant)
        kinds.push_back({&model, variant});
    return kinds;
  }();
  return all;
}

int surface_number(const Model& model, int variant) {
  const auto& all = surface_kinds();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const SurfaceKind& k) { return k.model == &model && k.variant == variant; });
  return static_cast<int>(found - all.begin()) + 1;
}

std::vector<SurfaceKind> surfaces_of(const LaunchData& data) {
  std::vector<SurfaceKind> result;
  for (const int number : numbers_of(data))
    if (number != SURFACE_NULL) result.push_back(surface_kinds()[static_cast<std::size_t>(number - 1)]);
  return result;
}

std::vector<BsdfRecord> numbered_bsdfs(const LaunchData& data) {
  std::set<int> numbers = numbers_of(data);
  numbers.insert(SURFACE_NULL);
  std::vector<BsdfRecord> bsdfs = data.bsdfs;
  for (BsdfRecord& bsdf : bsdfs)
    bsdf.surface = static_cast<int>(std::distance(numbers.begin(), numbers.find(bsdf.surface)));
  return bsdfs;
}

std::vector<std::string> stages_of(const LaunchData& data) {
#define ITN_STAGE_NAME(NAME, stage) #stage,
  std::vector<std::string> names{QUEUE_LIST(ITN_STAGE_NAME)};
  for (const SurfaceKind& kind : surfaces_of(data))
    names.push_back(fmt::format("{}_{}", kind.model->name, kind.variant));
  return names;
}

std::string surfaces_text(const LaunchData& data) {
  std::string surfaces, phases, textured;
  const std::vector<SurfaceKind> kinds = surfaces_of(data);
  for (std::size_t k = 0; k < kinds.size(); ++k)
    surfaces += fmt::format(" SURFACE({}, {}, {})", k + 1, kinds[k].model->name, kinds[k].variant);
  std::string media;
  int medium_count = 0, phase_count = 0;
  for (const Model& medium : medium_models()) {
    const auto has = [&](const MediumRecord& m) { return m.model == medium.id; };
    if (std::none_of(data.media.begin(), data.media.end(), has)) continue;
    media += fmt::format(" MEDIUM({}, {})", medium.name, capitals(medium.name));
    ++medium_count;
  }
  for (const Model& phase : phase_models()) {
    const auto has = [&](const MediumRecord& m) { return m.phase == phase.id; };
    if (std::none_of(data.media.begin(), data.media.end(), has)) continue;
    phases += fmt::format(" PHASE({}, {})", phase.name, capitals(phase.name));
    ++phase_count;
  }
  std::string lights;
  for (const Model& light : light_models())
    if (std::any_of(data.lights.begin(), data.lights.end(), [&](const LightRecord& l) { return l.model == light.id; }))
      lights += fmt::format(" LIGHT({}, {})", light.name, capitals(light.name));
  for (const auto& [model, slot] : data.textured)
    textured += fmt::format(" || ((model) == {} && (slot) == {})", model, slot);
  return fmt::format(
      "#define SURFACES {}\n#define SURFACE_LIST(SURFACE){}\n#define MEDIUM_COUNT {}\n#define "
      "MEDIA_OF_SCENE(MEDIUM){}\n"
      "#define PHASE_COUNT {}\n#define PHASES_OF_SCENE(PHASE){}\n"
      "#define LIGHTS_OF_SCENE(LIGHT){}\n#define TEXTURED(model, slot) (false{})\n",
      kinds.size(), surfaces, medium_count, media, phase_count, phases, lights, textured);
}

}  // namespace itn
