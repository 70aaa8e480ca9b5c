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

ModelsOfLaunch models_of(const LaunchData& data) {
  const auto some = [](const std::vector<Model>& models, const auto& is_there) {
    std::vector<const Model*> result;
    for (const Model& model : models)
      if (is_there(model)) result.push_back(&model);
    return result;
  };
  const std::vector<SurfaceKind> surfaces = surfaces_of(data);
  ModelsOfLaunch result;
  result.bsdfs = some(bsdf_models(), [&](const Model& model) {
    return std::any_of(surfaces.begin(), surfaces.end(), [&](const SurfaceKind& s) { return s.model == &model; });
  });
  result.media = some(medium_models(), [](const Model&) { return true; });
  result.phases = some(phase_models(), [&](const Model& model) {
    return std::any_of(data.media.begin(), data.media.end(),
                       [&](const MediumRecord& m) { return m.phase == model.id; });
  });
  result.lights = some(light_models(), [&](const Model& model) {
    return std::any_of(data.lights.begin(), data.lights.end(),
                       [&](const LightRecord& l) { return l.model == model.id; });
  });
  result.environments = some(environment_models(), [&](const Model& model) {
    return std::any_of(data.environments.begin(), data.environments.end(),
                       [&](const EnvironmentRecord& e) { return e.model == model.id; });
  });
  return result;
}

std::string surfaces_text(const LaunchData& data) {
  std::string surfaces, textured;
  const std::vector<SurfaceKind> kinds = surfaces_of(data);
  for (std::size_t k = 0; k < kinds.size(); ++k)
    surfaces += fmt::format(" SURFACE({}, {}, {})", k + 1, kinds[k].model->name, kinds[k].variant);
  for (const auto& [model, slot] : data.textured)
    textured += fmt::format(" || ((model) == {} && (slot) == {})", model, slot);
  const ModelsOfLaunch models = models_of(data);
  const auto list = [](const std::vector<const Model*>& family) {
    std::string text;
    for (const Model* model : family) text += fmt::format(" MODEL({}, {})", model->name, capitals(model->name));
    return text;
  };
  return fmt::format(
      "#define SURFACES {}\n#define SURFACE_LIST(SURFACE){}\n#define BSDFS_OF_SCENE(MODEL){}\n"
      "#define MEDIA_OF_SCENE(MODEL){}\n#define PHASE_COUNT {}\n#define PHASES_OF_SCENE(MODEL){}\n"
      "#define LIGHTS_OF_SCENE(MODEL){}\n#define ENVIRONMENTS_OF_SCENE(MODEL){}\n#define TEXTURED(model, slot) "
      "(false{})\n",
      kinds.size(), surfaces, list(models.bsdfs), list(models.media), models.phases.size(), list(models.phases),
      list(models.lights), list(models.environments), textured);
}

}  // namespace itn
