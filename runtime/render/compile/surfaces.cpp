#include "runtime/render/compile/surfaces.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "kernels/model/models.h"
#include "kernels/shared/path_state.h"
#include "runtime/scene/model/mixture.h"
#include "runtime/scene/model/structure.h"

namespace itn {
namespace {

std::string capitals(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::toupper(c); });
  return name;
}

// Uniform numbers that its samples take.
int random_of(const Model& model) {
#define ITN_RANDOM(name, PREFIX, type, variants) \
  if (model.id == MODEL_##name) return PREFIX##_RANDOM;
  BSDF_LIST(ITN_RANDOM)
  return 0;
}

std::set<int> numbers_of(const LaunchData& data) {
  std::set<int> numbers;
  for (const BsdfRecord& bsdf : data.bsdfs) numbers.insert(bsdf.surface);
  return numbers;
}

// Does light pass as through a thin pane? Sheets that scatter it change its direction.
bool is_pane(int traits) { return (traits & (BSDF_THIN | BSDF_SMOOTH)) == (BSDF_THIN | BSDF_SMOOTH); }

// A leaf's name among models, and the function of the nests around it.
std::string nests_text(const Structure& s, std::size_t at) {
  const Structure::Leaf& leaf = s.leaves[at];
  std::string text = fmt::format(
      "INLINE Nest {}_at_{}(const REAL* n, REAL3 wi, REAL3 wo) {{\n  Nest x = nest_begin(wi);\n", s.model.name, at);
  for (const Structure::Enter& nest : leaf.nests)
    text += fmt::format("  {}_enter({}, n + {}, wi, wo, &x);\n", nest.nest->name, nest.branch, s.first_of(nest.piece));
  if (!(s.traits_of(leaf) & BSDF_TRANSMITS) && leaf.piece >= 0) text += "  nest_opaque(wi, &x);\n";
  return text + "  return x;\n}\n";
}

// Declarations of a model's numbers, as its file would have them.
std::string declaration_text(const Model& m) {
  const std::string prefix = capitals(m.name);
  std::string numbers;
  for (const DeclaredNumber& n : m.numbers)
    numbers += fmt::format(" NUMBER({}, {}, {}, {}, {})", prefix, n.name, n.channels, n.role, n.coordinate);
  return fmt::format(
      "#define {0}_NUMBERS(NUMBER){1}\nenum {{ MODEL_{2} = {3} }};\nenum {{ {0}_NUMBERS(DECLARE_SLOT) {0}_SLOTS }};\n",
      prefix, numbers, m.name, m.id);
}

// As scattering/structure.h takes it.
std::string structure_text(const Structure& s) {
  const Model& m = s.model;
  const std::string prefix = capitals(m.name);
  std::string leaves, functions, bumps, measured;
  int random = 0;
  for (std::size_t at = 0; at < s.leaves.size(); ++at) {
    const Structure::Leaf& leaf = s.leaves[at];
    const bool passes = leaf.piece < 0;
    const int variant = passes ? 0 : s.pieces[static_cast<std::size_t>(leaf.piece)].variant;
    leaves += fmt::format(" LEAF({}, {}, {}, {}, {}, {}, {})", m.name, at,
                          passes ? std::string("PASSAGE_LEAF") : std::to_string(at),
                          passes ? "passage" : s.model_of(leaf)->name, variant, s.first_of(leaf.piece),
                          !passes && is_pane(s.traits_of(leaf)) ? 1 : 0);
    if (!passes && (s.traits_of(leaf) & BSDF_MEASURED))
      measured += fmt::format(" LEAF({}, {}, {})", m.name, at, s.first_of(leaf.piece));
    if (!passes) random = std::max(random, random_of(*s.model_of(leaf)));
    functions += nests_text(s, at);
  }
  for (const Piece& piece : s.pieces)
    if (piece.model->traits & BSDF_BUMPED) bumps += fmt::format(" BUMP({})", piece.first_number);
  return declaration_text(m) +
         fmt::format(
             "#define {0}_TRAITS {1}\n#define {0}_RANDOM {2}\n#define "
             "{0}_LEAVES(LEAF){3}\n#define {0}_BUMPS(BUMP){4}\n#define {0}_MEASURED(LEAF){5}\n{6}",
             prefix, m.traits, random, leaves, bumps, measured, functions);
}

// A table or a mixture, as scattering/mixture.h takes it.
std::string phase_text(const Model& m) {
  const std::string prefix = capitals(m.name);
  if (m.table) return declaration_text(m) + fmt::format("#define {}_VALUES {}\n", prefix, m.table);
  std::string parts;
  const std::vector<Mixture::Part>& all = m.mixture->parts;
  for (std::size_t k = 0; k < all.size(); ++k)
    parts += fmt::format(" PART({}, {}, {})", k, all[k].model->name, all[k].first);
  return declaration_text(m) +
         fmt::format("#define {0}_PARTS {1}\n#define {0}_EACH(PART){2}\n", prefix, all.size(), parts);
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
  if (model.structure) return model.id;
  const auto& all = surface_kinds();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const SurfaceKind& k) { return k.model == &model && k.variant == variant; });
  return static_cast<int>(found - all.begin()) + 1;
}

std::vector<SurfaceKind> surfaces_of(const LaunchData& data) {
  std::vector<SurfaceKind> result;
  for (const int number : numbers_of(data)) {
    const auto place = static_cast<std::size_t>(number - 1);
    const auto structure = data.structures.find(number);
    if (structure != data.structures.end())
      result.push_back({structure->second, 0});
    else if (number != SURFACE_NULL)
      result.push_back(surface_kinds()[place]);
  }
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
  for (const SurfaceKind& kind : surfaces)
    if (kind.model->structure) result.structures.push_back(kind.model);
  result.media = some(medium_models(), [&](const Model& model) {
    return std::any_of(data.media.begin(), data.media.end(),
                       [&](const MediumRecord& m) { return m.model == model.id; });
  });
  for (const auto& [id, model] : data.phases) result.phases.push_back(model);
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

std::vector<const Model*> made_models(const LaunchData& data) {
  std::vector<const Model*> result;
  const auto add = [&](const Model* model) {
    const bool made = model->structure || model->mixture || model->table;
    if (made && std::find(result.begin(), result.end(), model) == result.end()) result.push_back(model);
  };
  for (const auto& [id, model] : data.structures) add(model);
  for (const auto& [id, model] : data.phases) {
    if (model->mixture)
      for (const Mixture::Part& part : model->mixture->parts) add(part.model);
    add(model);
  }
  return result;
}

int origin_words(const LaunchData& data) {
  int slots = 1;
  for (const auto& [id, model] : data.structures) slots = std::max(slots, model->number_slots);
  return (slots + TEXTURED_SLOTS - 1) / TEXTURED_SLOTS;
}

std::string surfaces_text(const LaunchData& data) {
  std::string surfaces, textured;
  const std::vector<SurfaceKind> kinds = surfaces_of(data);
  for (std::size_t k = 0; k < kinds.size(); ++k)
    surfaces += fmt::format(" SURFACE({}, {}, {})", k + 1, kinds[k].model->name, kinds[k].variant);
  std::string passed;
  for (std::size_t k = 0; k < kinds.size(); ++k)
    if (kinds[k].model->traits & BSDF_PASSES) passed += fmt::format(" SURFACE({}, {}, 0)", k + 1, kinds[k].model->name);
  for (const auto& [model, slot] : data.textured)
    textured += fmt::format(" || ((model) == {} && (slot) == {})", model, slot);
  const ModelsOfLaunch models = models_of(data);
  std::vector<const Model*> tables, mixtures;
  for (const Model* model : made_models(data)) {
    if (model->table) tables.push_back(model);
    if (model->mixture) mixtures.push_back(model);
  }
  const auto list = [](const std::vector<const Model*>& family) {
    std::string text;
    for (const Model* model : family) text += fmt::format(" MODEL({}, {})", model->name, capitals(model->name));
    return text;
  };
  return fmt::format(
      "#define SURFACES {}\n#define SURFACE_LIST(SURFACE){}\n#define BSDFS_OF_SCENE(MODEL){}\n"
      "#define MEDIUM_COUNT {}\n#define MEDIA_OF_SCENE(MODEL){}\n#define PHASE_COUNT {}\n#define "
      "PHASES_OF_SCENE(MODEL){}\n"
      "#define TABLES_OF_SCENE(MODEL){}\n#define MIXTURES_OF_SCENE(MODEL){}\n"
      "#define LIGHTS_OF_SCENE(MODEL){}\n#define ENVIRONMENTS_OF_SCENE(MODEL){}\n#define TEXTURED(model, slot) "
      "(false{})\n"
      "#define STRUCTURES_OF_SCENE(MODEL){}\n#define PASSED_SURFACES(SURFACE){}\n#define ORIGIN_WORDS {}\n",
      kinds.size(), surfaces, list(models.bsdfs), models.media.size(), list(models.media), models.phases.size(),
      list(models.phases), list(tables), list(mixtures), list(models.lights), list(models.environments), textured,
      list(models.structures), passed, origin_words(data));
}

std::string structures_text(const LaunchData& data) {
  std::string text;
  for (const Model* model : made_models(data))
    text += model->structure ? structure_text(*model->structure) : phase_text(*model);
  return text;
}

}  // namespace itn
